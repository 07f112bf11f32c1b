//! The linear system of one step, solved along time.

use super::model::{AVERAGE, LEVEL, Model, Unknowns};

/// An unknown expressed by those eliminated after it.
#[derive(Clone, Copy, Default)]
struct Row {
    /// The reciprocal of the unknown's pivot.
    inverse: f64,
    /// The coefficients of the two states after it.
    states: [f64; 2],
    /// The coefficients of the unknowns of the level.
    level: [f64; LEVEL],
}

/// The `LDLᵀ` factorisation of the symmetric, positive definite matrix of a step.
///
/// Unknowns are eliminated in order of time: a state once two others have followed, a spline when its support
/// ends, the line last. Each unknown couples to at most nine others, so time and memory are linear in the
/// number of samples.
pub(super) struct Factor {
    states: Vec<Row>,
    splines: Vec<Row>,
    line: [[f64; 2]; 2],
}

/// The active unknowns, whose equations are not yet complete.
struct Front {
    /// The block of three states, the oldest first.
    states: [[f64; 3]; 3],
    /// The block of the states with the level.
    mixed: [[f64; LEVEL]; 3],
    level: [[f64; LEVEL]; LEVEL],
}

impl Factor {
    /// Allocates the factors for the steps of a model.
    pub(super) fn new(model: &Model) -> Factor {
        let states = vec![Row::default(); model.count];
        Factor { states, splines: vec![Row::default(); model.blocks() + 1], line: [[0.0; 2]; 2] }
    }

    /// Factorises the matrix for the given weights of the samples in the fit, of the squared drivers, and of
    /// the squared splines.
    pub(super) fn factorise(&mut self, model: &Model, fit: &[f64], drivers: &[f64], spline: f64) {
        let blocks = model.blocks();
        let mut front =
            Front { states: [[0.0; 3]; 3], mixed: [[0.0; LEVEL]; 3], level: [[0.0; LEVEL]; LEVEL] };
        (1..4).for_each(|k| front.level[k][k] = if k <= blocks { spline } else { 0.0 });
        for block in 0..blocks {
            for sample in model.samples(block) {
                let weights = model.level_weights(block, sample);
                front.add(model, sample, [fit[sample], drivers[sample]], &weights);
                if sample >= 2 {
                    self.states[sample - 2] = front.eliminate_state();
                }
                front.shift_states();
            }
            self.splines[block] =
                front.eliminate_spline(if block + 3 < blocks { spline } else { 0.0 });
        }
        self.splines[blocks] = front.eliminate_spline(0.0);
        for state in &mut self.states[model.count - 2..] {
            *state = front.eliminate_state();
            front.shift_states();
        }
        let [a, b] = [front.level[4], front.level[5]].map(|row| [row[4], row[5]]);
        let determinant = a[0] * b[1] - a[1] * b[0];
        self.line = [[b[1], -a[1]], [-b[0], a[0]]].map(|row| row.map(|each| each / determinant));
    }

    /// Replaces the right-hand side by the solution.
    pub(super) fn solve(&self, model: &Model, sides: &mut Unknowns) {
        let (count, blocks) = (model.count, model.blocks());
        let mut level = sides.level(0);
        for block in 0..=blocks {
            for sample in model.samples(block).filter(|&sample| sample >= 2) {
                let row = &self.states[sample - 2];
                let side = sides.states[sample - 2];
                row.spread(side, &mut sides.states[sample - 1..=sample], &mut level);
            }
            let end = model.samples(block).end.min(count);
            let side = level[0];
            self.splines[block].spread(side, &mut sides.states[end - 2..end], &mut level);
            if let Some(spline) = block.checked_sub(1) {
                sides.splines[spline] = side;
            }
            level.copy_within(1..4, 0);
            level[3] = sides.splines.get(block + 3).copied().unwrap_or(0.0);
        }
        for state in count - 2..count {
            let side = sides.states[state];
            self.states[state].spread(side, &mut sides.states[state + 1..], &mut level);
        }
        sides.line = self.line.map(|row| row[0] * level[4] + row[1] * level[5]);
        self.solve_backwards(model, sides);
    }

    fn solve_backwards(&self, model: &Model, sides: &mut Unknowns) {
        let (count, blocks) = (model.count, model.blocks());
        let mut level = [0.0, 0.0, 0.0, 0.0, sides.line[0], sides.line[1]];
        for state in (count - 2..count).rev() {
            sides.states[state] =
                self.states[state].gather(sides.states[state], &sides.states[state + 1..], &level);
        }
        for block in (0..=blocks).rev() {
            let end = model.samples(block).end.min(count);
            level.copy_within(0..3, 1);
            if let Some(spline) = block.checked_sub(1) {
                let side = sides.splines[spline];
                level[0] = self.splines[block].gather(side, &sides.states[end - 2..end], &level);
                sides.splines[spline] = level[0];
            }
            for sample in model.samples(block).rev().filter(|&sample| sample >= 2) {
                let side = sides.states[sample - 2];
                let after = &sides.states[sample - 1..=sample];
                sides.states[sample - 2] = self.states[sample - 2].gather(side, after, &level);
            }
        }
    }
}

impl Row {
    /// Forward substitution of this unknown into those that come after it.
    fn spread(&self, side: f64, states: &mut [f64], level: &mut [f64; LEVEL]) {
        states.iter_mut().zip(self.states).for_each(|(state, share)| *state -= share * side);
        level.iter_mut().zip(self.level).for_each(|(each, share)| *each -= share * side);
    }

    /// Back substitution of the unknown from those after it.
    fn gather(&self, side: f64, states: &[f64], level: &[f64; LEVEL]) -> f64 {
        let states: f64 = states.iter().zip(self.states).map(|(state, share)| state * share).sum();
        let level: f64 = level.iter().zip(self.level).map(|(each, share)| each * share).sum();
        side * self.inverse - states - level
    }
}

impl Front {
    /// Adds the contribution of one sample.
    fn add(
        &mut self,
        model: &Model,
        sample: usize,
        [fit, driver]: [f64; 2],
        weights: &[f64; LEVEL],
    ) {
        for (row, weight) in self.level.iter_mut().zip(weights) {
            row.iter_mut().zip(weights).for_each(|(sum, other)| *sum += fit * weight * other);
        }
        if sample < 2 {
            return;
        }
        let [now, before, earlier] = model.driver;
        let (driven, averaged) = ([earlier, before, now], AVERAGE);
        for a in 0..3 {
            for b in 0..3 {
                self.states[a][b] +=
                    driver * driven[a] * driven[b] + fit * averaged[a] * averaged[b];
            }
            let share = fit * averaged[a];
            self.mixed[a].iter_mut().zip(weights).for_each(|(sum, weight)| *sum += share * weight);
        }
    }

    /// Eliminates the oldest state.
    fn eliminate_state(&mut self) -> Row {
        let inverse = inverse(self.states[0][0]);
        let [_, first, second] = self.states[0];
        let mixed = self.mixed[0];
        let states = [first * inverse, second * inverse];
        let level = mixed.map(|each| each * inverse);
        for (a, share) in states.into_iter().enumerate() {
            self.states[a + 1][1] -= share * first;
            self.states[a + 1][2] -= share * second;
            self.mixed[a + 1].iter_mut().zip(mixed).for_each(|(each, by)| *each -= share * by);
        }
        self.reduce_level(&level, &mixed);
        Row { inverse, states, level }
    }

    /// Shifts the front by one state.
    fn shift_states(&mut self) {
        let [_, [_, a, b], [_, c, d]] = self.states;
        self.states = [[a, b, 0.0], [c, d, 0.0], [0.0; 3]];
        self.mixed = [self.mixed[1], self.mixed[2], [0.0; LEVEL]];
    }

    /// Eliminates the oldest spline, and adds a new one with the weight `next`.
    fn eliminate_spline(&mut self, next: f64) -> Row {
        let inverse = inverse(self.level[0][0]);
        let mut here = self.level[0];
        here[0] = 0.0;
        let mixed = [self.mixed[0][0], self.mixed[1][0]];
        let level = here.map(|each| each * inverse);
        let states = mixed.map(|each| each * inverse);
        for (a, share) in states.into_iter().enumerate() {
            (0..2).for_each(|b| self.states[a][b] -= share * mixed[b]);
            self.mixed[a].iter_mut().zip(here).for_each(|(each, by)| *each -= share * by);
            self.mixed[a].copy_within(1..4, 0);
            self.mixed[a][3] = 0.0;
        }
        self.reduce_level(&level, &here);
        self.level.copy_within(1..4, 0);
        self.level[3] = [0.0; LEVEL];
        for row in &mut self.level {
            row.copy_within(1..4, 0);
            row[3] = 0.0;
        }
        self.level[3][3] = next;
        Row { inverse, states, level }
    }

    fn reduce_level(&mut self, shares: &[f64; LEVEL], by: &[f64; LEVEL]) {
        for (row, share) in self.level.iter_mut().zip(shares) {
            row.iter_mut().zip(by).for_each(|(each, by)| *each -= share * by);
        }
    }
}

/// The reciprocal of a pivot; 0 for an absent unknown.
fn inverse(pivot: f64) -> f64 {
    if pivot > 0.0 { 1.0 / pivot } else { 0.0 }
}
