//! The fit's working memory: models, normal matrix, noise. Lent, or it would lie on the stack.

use core::cell::RefCell;

use super::fit::Fit;
use super::judge::Noise;
use super::parameters::Model;
use super::tones::Shapes;

/// Models that are in use at once besides the two that stay: a search puts a tone away, gives another one a shape, asks
/// whether that is two, and refines; and one more.
pub(crate) const SPARES: usize = 5;

/// Working memory of an [`Estimator`](super::Estimator): 25 KB, and 75 KB with the feature `many-unknowns`. Nothing in it
/// outlasts a window but the shapes of its peaks. All zeros at first, so that a static of it lies in `.bss`.
#[derive(Clone, Debug)]
pub struct Workspace {
    pub(crate) fit: Fit,
    pub(crate) model: Model,
    /// What explains the samples as if the noise were white.
    pub(crate) plain: Model,
    pub(crate) spares: [RefCell<Model>; SPARES],
    pub(crate) noise: [Noise; 2],
    pub(crate) shapes: Shapes,
}

impl Workspace {
    /// Empty memory.
    pub const fn new() -> Self {
        Self {
            fit: Fit::new(),
            model: Model::new(0),
            plain: Model::new(0),
            spares: [const { RefCell::new(Model::new(0)) }; SPARES],
            noise: [Noise::new(), Noise::new()],
            shapes: Shapes::new(),
        }
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}
