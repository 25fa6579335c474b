//! Kinds of machines and where their evaluation zones begin: velocities from 10 Hz to 1000 Hz, mm/s RMS, on
//! parts that do not rotate.

/// A kind of machine after a part of ISO 20816 or ISO 10816.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// As `--machine` takes it.
    pub name: &'static str,
    /// Where zones B, C and D begin, mm/s RMS.
    pub limits_mm_s: [f64; 3],
    /// What it is, and which table of which standard says so.
    pub source: &'static str,
}

const fn machine(name: &'static str, limits_mm_s: [f64; 3], source: &'static str) -> Machine {
    Machine {
        name,
        limits_mm_s,
        source,
    }
}

/// All of them. ISO 20816-3:2022 took the velocities of ISO 10816-3:2009 over; pumps were groups 3 and 4 of its first
/// edition, of 1998. Both also limit the displacement, which is not judged here.
pub const MACHINES: [Machine; 12] = [
    machine(
        "iso20816-3:group1:rigid",
        [2.3, 4.5, 7.1],
        "above 300 kW, or shafts 315 mm high and more (ISO 20816-3:2022, A.1)",
    ),
    machine(
        "iso20816-3:group1:flexible",
        [3.5, 7.1, 11.0],
        "above 300 kW, or shafts 315 mm high and more (ISO 20816-3:2022, A.1)",
    ),
    machine(
        "iso20816-3:group2:rigid",
        [1.4, 2.8, 4.5],
        "15 kW to 300 kW, or shafts 160 mm to 315 mm high (ISO 20816-3:2022, A.2)",
    ),
    machine(
        "iso20816-3:group2:flexible",
        [2.3, 4.5, 7.1],
        "15 kW to 300 kW, or shafts 160 mm to 315 mm high (ISO 20816-3:2022, A.2)",
    ),
    machine(
        "iso10816-3:group3:rigid",
        [2.3, 4.5, 7.1],
        "pumps above 15 kW with a separate driver (ISO 10816-3:1998, A.3)",
    ),
    machine(
        "iso10816-3:group3:flexible",
        [3.5, 7.1, 11.0],
        "pumps above 15 kW with a separate driver (ISO 10816-3:1998, A.3)",
    ),
    machine(
        "iso10816-3:group4:rigid",
        [1.4, 2.8, 4.5],
        "pumps above 15 kW with a built-in driver (ISO 10816-3:1998, A.4)",
    ),
    machine(
        "iso10816-3:group4:flexible",
        [2.3, 4.5, 7.1],
        "pumps above 15 kW with a built-in driver (ISO 10816-3:1998, A.4)",
    ),
    machine(
        "iso10816-1:class1",
        [0.71, 1.8, 4.5],
        "parts of machines, motors to 15 kW (ISO 10816-1:1995, B)",
    ),
    machine(
        "iso10816-1:class2",
        [1.12, 2.8, 7.1],
        "15 kW to 75 kW, to 300 kW on special foundations (ISO 10816-1:1995, B)",
    ),
    machine(
        "iso10816-1:class3",
        [1.8, 4.5, 11.2],
        "large, on rigid and heavy foundations (ISO 10816-1:1995, B)",
    ),
    machine(
        "iso10816-1:class4",
        [2.8, 7.1, 18.0],
        "large, on soft foundations (ISO 10816-1:1995, B)",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_machine_has_a_name_of_its_own_and_rising_limits() {
        for machine in &MACHINES {
            let [b, c, d] = machine.limits_mm_s;
            assert!(0.0 < b && b < c && c < d, "{machine:?}");
            let same = MACHINES.iter().filter(|m| m.name == machine.name);
            assert_eq!(same.count(), 1, "{machine:?}");
            assert!(machine.source.contains("ISO"));
        }
    }
}
