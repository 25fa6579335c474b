//! Nelder and Mead's downhill simplex (1965).

/// Costs of all corners within this part of each other: the bottom is reached.
const FLAT: f64 = 1e-10;

/// Where `cost` is least, from `start`; `size` is the first simplex's, 0 for what stays as it is.
pub(super) fn minimum<const N: usize>(
    cost: impl Fn(&[f64; N]) -> f64,
    start: [f64; N],
    size: [f64; N],
) -> [f64; N] {
    let mut simplex: Vec<([f64; N], f64)> = (0..=N)
        .map(|i| {
            let mut p = start;
            if i > 0 {
                p[i - 1] += size[i - 1];
            }
            (p, cost(&p))
        })
        .collect();
    for _ in 0..60 * N {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let worst = simplex[N];
        if worst.1 - simplex[0].1 <= FLAT * simplex[0].1.abs() {
            break;
        }
        let centre: [f64; N] =
            std::array::from_fn(|k| simplex[..N].iter().map(|s| s.0[k]).sum::<f64>() / N as f64);
        let at = |t: f64| {
            let p: [f64; N] = std::array::from_fn(|k| centre[k] + t * (centre[k] - worst.0[k]));
            (p, cost(&p))
        };
        let reflected = at(1.0);
        let next = if reflected.1 < simplex[0].1 {
            let further = at(2.0);
            if further.1 < reflected.1 {
                further
            } else {
                reflected
            }
        } else if reflected.1 < simplex[N - 1].1 {
            reflected
        } else {
            at(-0.5)
        };
        if next.1 < worst.1 {
            simplex[N] = next;
        } else {
            let best = simplex[0].0;
            for vertex in &mut simplex[1..] {
                let p: [f64; N] = std::array::from_fn(|k| 0.5 * (vertex.0[k] + best[k]));
                *vertex = (p, cost(&p));
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_and_keeps_what_is_fixed() {
        let bowl = |p: &[f64; 3]| (p[0] - 1.0).powi(2) + 4.0 * (p[1] + 2.0 - p[0]).powi(2) + p[2];
        let [x, y, z] = minimum(bowl, [0.0, 0.0, 5.0], [0.3, 0.3, 0.0]);
        assert!((x - 1.0).abs() < 1e-6 && (y + 1.0).abs() < 1e-6, "{x} {y}");
        assert_eq!(z, 5.0);
    }
}
