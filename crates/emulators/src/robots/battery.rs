//! The battery: three lithium-ion cells in series, with a protection circuit that cuts off.
//!
//! The cells are those of Chen and Rincón-Mora (2006, doi:10.1109/TEC.2006.874229): the open-circuit voltage, the
//! series resistance and two RC pairs as functions of the state of charge. Their cell has 0.85 Ah; a larger one is
//! several of them in parallel.

/// The number of cells in series.
pub const CELLS: u32 = 3;
/// The capacity of the cell that the coefficients describe [Ah].
const CELL_AH: f64 = 0.85;
/// The cell voltage below which the protection cuts off [V].
const CUT_OFF_CELL_V: f64 = 3.0;
/// The temperature around the robot [°C].
const AMBIENT_C: f64 = 22.0;
/// The thermal resistance of the pack [K/W].
const WARMING_K_PER_W: f64 = 8.0;
/// The heat capacity of the pack [J/K].
const HEAT_J_PER_K: f64 = 130.0;
/// The smallest capacitances at which the fits are trusted near empty [F].
const LEAST_F: (f64, f64) = (50.0, 500.0);

/// A cell at one state of charge.
#[derive(Clone, Copy, Debug)]
struct Cell {
    open_v: f64,
    series_ohm: f64,
    short: Pair,
    long: Pair,
}

/// A resistor and a capacitor in parallel.
#[derive(Clone, Copy, Debug)]
struct Pair {
    ohm: f64,
    farad: f64,
}

impl Cell {
    /// Returns the cell at a state of charge, by equations 2 to 7 of Chen and Rincón-Mora.
    fn at(fraction: f64) -> Cell {
        let fit = |scale: f64, fall: f64, rest: f64| scale * (-fall * fraction).exp() + rest;
        let cubic = fraction * (0.2156 + fraction * (-0.1178 + fraction * 0.3201));
        Cell {
            open_v: fit(-1.031, 35.0, 3.685) + cubic,
            series_ohm: fit(0.1562, 24.37, 0.07446),
            short: Pair {
                ohm: fit(0.3208, 29.14, 0.04669),
                farad: fit(-752.9, 13.51, 703.6).max(LEAST_F.0),
            },
            long: Pair {
                ohm: fit(6.603, 155.2, 0.04984),
                farad: fit(-6056.0, 27.12, 4475.0).max(LEAST_F.1),
            },
        }
    }
}

impl Pair {
    /// Returns the voltage after a constant current for some time [V], which is exact for such a pair.
    fn voltage_after(self, before_v: f64, current_a: f64, secs: f64) -> f64 {
        let kept = (-secs / (self.ohm * self.farad)).exp();
        before_v * kept + current_a * self.ohm * (1.0 - kept)
    }
}

/// A pack of cells that is discharged by the drawn power.
#[derive(Clone, Debug)]
pub struct Pack {
    capacity_ah: f64,
    charge_ah: f64,
    short_v: f64,
    long_v: f64,
    reading: Reading,
    drawn_j: f64,
    is_cut_off: bool,
}

/// The measurable state of a pack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The voltage between the terminals [V].
    pub voltage_v: f64,
    /// The current out of the pack [A].
    pub current_a: f64,
    /// The temperature of the cells [°C].
    pub temperature_c: f64,
}

impl Pack {
    /// Creates a rested pack with a capacity, charged to a fraction of it.
    pub fn new(capacity_ah: f64, fraction: f64) -> Pack {
        let voltage_v = f64::from(CELLS) * Cell::at(fraction).open_v;
        Pack {
            capacity_ah,
            charge_ah: capacity_ah * fraction,
            short_v: 0.0,
            long_v: 0.0,
            reading: Reading { voltage_v, current_a: 0.0, temperature_c: AMBIENT_C },
            drawn_j: 0.0,
            is_cut_off: false,
        }
    }

    /// The present measurable state.
    pub fn reading(&self) -> Reading {
        self.reading
    }

    /// The capacity when full [Ah].
    pub fn capacity_ah(&self) -> f64 {
        self.capacity_ah
    }

    /// The remaining charge [Ah].
    pub fn charge_ah(&self) -> f64 {
        self.charge_ah
    }

    /// The state of charge [0..1].
    pub fn fraction(&self) -> f64 {
        self.charge_ah / self.capacity_ah
    }

    /// The energy drawn so far [J].
    pub fn drawn_j(&self) -> f64 {
        self.drawn_j
    }

    /// Whether the protection has cut off; it does not reset.
    pub fn is_cut_off(&self) -> bool {
        self.is_cut_off
    }

    /// Delivers a power for a short time. A sag lowers the voltage by `sag_v`, like a failing cell.
    pub fn draw(&mut self, power_w: f64, sag_v: f64, secs: f64) {
        let cell = Cell::at(self.fraction().clamp(0.0, 1.0));
        let series_ohm = self.pack_ohm(cell.series_ohm);
        let inner_v = f64::from(CELLS) * cell.open_v - self.short_v - self.long_v - sag_v;
        let power_w = if self.is_cut_off { 0.0 } else { power_w };
        let solved = current_a(power_w, inner_v, series_ohm);
        let current_a = solved.unwrap_or(0.0);
        self.short_v = self.pair(cell.short).voltage_after(self.short_v, current_a, secs);
        self.long_v = self.pair(cell.long).voltage_after(self.long_v, current_a, secs);
        self.charge_ah = (self.charge_ah - current_a * secs / 3600.0).max(0.0);
        let voltage_v = inner_v - current_a * series_ohm;
        self.drawn_j += voltage_v * current_a * secs;
        let lost_w = current_a * (current_a * series_ohm + self.short_v + self.long_v);
        let temperature_c = self.warmed_c(lost_w, secs);
        self.reading = Reading { voltage_v, current_a, temperature_c };
        let is_empty = voltage_v < f64::from(CELLS) * CUT_OFF_CELL_V || self.charge_ah <= 0.0;
        self.is_cut_off |= solved.is_none() || is_empty;
    }

    fn warmed_c(&self, lost_w: f64, secs: f64) -> f64 {
        let before_c = self.reading.temperature_c;
        let cooling_w = (before_c - AMBIENT_C) / WARMING_K_PER_W;
        before_c + (lost_w - cooling_w) * secs / HEAT_J_PER_K
    }

    /// Returns the resistance of all cells, in series and in parallel [Ω].
    fn pack_ohm(&self, cell_ohm: f64) -> f64 {
        cell_ohm * f64::from(CELLS) * CELL_AH / self.capacity_ah
    }

    fn pair(&self, cell: Pair) -> Pair {
        let ohm = self.pack_ohm(cell.ohm);
        Pair { ohm, farad: cell.farad * cell.ohm / ohm }
    }
}

/// Returns the current at which a source delivers a power: the smaller root of `P = I (E - I R)` [A]; `None` if it
/// can't deliver that much.
fn current_a(power_w: f64, source_v: f64, series_ohm: f64) -> Option<f64> {
    let discriminant = source_v * source_v - 4.0 * series_ohm * power_w;
    let possible = source_v > 0.0 && discriminant >= 0.0;
    possible.then(|| 2.0 * power_w / (source_v + discriminant.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_current_at_the_terminals_gives_the_power() {
        let mut pack = Pack::new(1.8, 0.8);
        for _ in 0..2000 {
            pack.draw(17.0, 0.0, 0.05);
            let Reading { voltage_v, current_a, .. } = pack.reading();
            assert!((voltage_v * current_a - 17.0).abs() < 1e-9);
        }
        assert!((pack.drawn_j() - 17.0 * 100.0).abs() < 1e-6);
    }

    #[test]
    fn the_charge_that_is_gone_is_the_current_over_time() {
        let mut pack = Pack::new(1.8, 1.0);
        let mut gone_ah = 0.0;
        for second in 0..1200 {
            pack.draw(10.0 + f64::from(second % 7), 0.0, 1.0);
            gone_ah += pack.reading().current_a / 3600.0;
        }
        assert!((1.8 - pack.charge_ah() - gone_ah).abs() < 1e-9);
    }

    #[test]
    fn a_pack_of_twenty_watt_hours_lasts_about_an_hour_and_then_cuts_off() {
        let mut pack = Pack::new(1.8, 1.0);
        let mut secs = 0;
        while !pack.is_cut_off() && secs < 7200 {
            let before_v = pack.reading().voltage_v;
            pack.draw(17.0, 0.0, 1.0);
            secs += 1;
            assert!(secs == 1 || pack.reading().voltage_v <= before_v + 1e-9);
        }
        assert!((3600..4600).contains(&secs), "{secs} s");
        assert!(pack.fraction() < 0.05, "{}", pack.fraction());
        pack.draw(17.0, 0.0, 1.0);
        assert!(pack.reading().current_a.abs() < 1e-12);
    }

    #[test]
    fn the_first_ten_minutes_lie_in_the_flat_part() {
        let mut pack = Pack::new(1.8, 1.0);
        (0..600).for_each(|_| pack.draw(17.0, 0.0, 1.0));
        assert!(pack.fraction() > 0.8, "{}", pack.fraction());
        assert!(pack.reading().voltage_v > 11.0, "{:?}", pack.reading());
        assert!((23.0..30.0).contains(&pack.reading().temperature_c), "{:?}", pack.reading());
    }

    #[test]
    fn a_sag_lowers_the_voltage_and_a_deep_one_cuts_off() {
        let mut pack = Pack::new(1.8, 0.8);
        pack.draw(15.0, 0.0, 1.0);
        let healthy_v = pack.reading().voltage_v;
        pack.draw(15.0, 1.0, 1.0);
        assert!(pack.reading().voltage_v < healthy_v - 0.9);
        assert!(!pack.is_cut_off());
        pack.draw(15.0, 4.0, 1.0);
        assert!(pack.is_cut_off());
    }
}
