//! A primal–dual interior-point solver for the quadratic program.

use super::factor::Factor;
use super::model::{AVERAGE, Model, Unknowns};
use super::{DRIVER_PENALTY, LEVEL_PENALTY};
use crate::error::SignalError;

/// The most steps; recordings take ten to twenty-five.
const MOST_STEPS: usize = 100;
/// Convergence: the duality gap relative to the cost (for a signal with a standard deviation of 1), and the
/// residual of the equations.
const GAP: f64 = 1e-10;
const RESIDUAL: f64 = 1e-8;
/// The gap accepted when no further step is possible.
const LEAST_GAP: f64 = 1e-6;
/// The largest share of the distance to the boundary that a step takes.
const SHARE: f64 = 0.995;

/// A primal–dual interior-point method: Mehrotra (1992), doi:10.1137/0802028.
pub(super) struct Interior<'a> {
    model: &'a Model,
    signal: &'a [f64],
    /// The weight of each sample in the fit.
    fit: &'a [f64],
    penalty: f64,
    unknowns: Unknowns,
    /// The slacks of the drivers, all positive.
    slacks: Vec<f64>,
    /// The multipliers of the drivers' bounds, all positive.
    prices: Vec<f64>,
    /// Multipliers over slacks: the weights of the squared drivers in a step.
    ratios: Vec<f64>,
    /// The residuals of the drivers' bounds.
    missing: Vec<f64>,
    /// The centring and second-order terms of each multiplier.
    centring: Vec<f64>,
    /// The weighted residuals of the fit.
    errors: Vec<f64>,
    scratch: Vec<f64>,
    step: Step,
    factor: Factor,
}

struct Step {
    unknowns: Unknowns,
    slacks: Vec<f64>,
    prices: Vec<f64>,
}

impl<'a> Interior<'a> {
    /// The starting point: a fit with a penalty on the squared drivers instead of bounds.
    pub(super) fn new(
        model: &'a Model,
        signal: &'a [f64],
        fit: &'a [f64],
        scale: f64,
    ) -> Interior<'a> {
        let zeros = || vec![0.0; model.count];
        let step = Step { unknowns: model.zeros(), slacks: zeros(), prices: zeros() };
        Interior {
            model,
            signal,
            fit,
            penalty: DRIVER_PENALTY / scale,
            unknowns: model.zeros(),
            slacks: zeros(),
            prices: zeros(),
            ratios: zeros(),
            missing: zeros(),
            centring: zeros(),
            errors: zeros(),
            scratch: zeros(),
            step,
            factor: Factor::new(model),
        }
    }

    /// The unknowns at the optimum.
    pub(super) fn solve(mut self) -> Result<Unknowns, SignalError> {
        self.begin();
        let mut best = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let (gap, residual) = self.state();
            if gap <= GAP && residual <= RESIDUAL {
                return Ok(self.unknowns);
            }
            if !gap.is_finite() {
                return Err(SignalError::Overflow);
            }
            best = gap;
            if self.advance() < 1e-8 {
                break;
            }
        }
        if best <= LEAST_GAP { Ok(self.unknowns) } else { Err(SignalError::Overflow) }
    }

    fn bound(&self) -> std::ops::Range<usize> {
        2..self.model.count
    }

    fn begin(&mut self) {
        let driver = self.model.driver[0];
        self.ratios.fill(1.0 / (driver * driver));
        self.refresh_errors();
        self.factorise();
        self.direction();
        std::mem::swap(&mut self.unknowns, &mut self.step.unknowns);
        self.model.drivers(&self.unknowns.states, &mut self.slacks);
        let bound = self.bound();
        let mean = self.slacks[bound.clone()].iter().map(|each| each.abs()).sum::<f64>()
            / bound.len() as f64;
        let least = mean.max(1e-12);
        for slack in &mut self.slacks[bound.clone()] {
            *slack = slack.max(least);
        }
        for sample in bound {
            self.prices[sample] = self.penalty * least / self.slacks[sample];
        }
    }

    /// The relative duality gap and the relative residual.
    fn state(&mut self) -> (f64, f64) {
        self.refresh_errors();
        self.model.drivers(&self.unknowns.states, &mut self.missing);
        let mut gap = 0.0;
        let mut infeasible: f64 = 0.0;
        let mut drivers = 0.0;
        for sample in self.bound() {
            gap += self.slacks[sample] * self.prices[sample];
            drivers += self.missing[sample].max(0.0);
            self.missing[sample] -= self.slacks[sample];
            infeasible = infeasible.max(self.missing[sample].abs());
            self.ratios[sample] = self.prices[sample] / self.slacks[sample];
            self.centring[sample] = 0.0;
            self.scratch[sample] = self.penalty - self.prices[sample];
        }
        let squares: f64 = self.errors.iter().map(|each| each * each).sum();
        let splines: f64 = self.unknowns.splines.iter().map(|each| each * each).sum();
        let cost = 0.5 * squares + self.penalty * drivers + 0.5 * LEVEL_PENALTY * splines;
        self.gradient_into_step();
        let slope = self.step.unknowns.states.iter().map(|each| each.abs()).fold(0.0, f64::max);
        (gap / (1.0 + cost), slope.max(infeasible / self.model.driver[0]))
    }

    fn refresh_errors(&mut self) {
        Model::responses(&self.unknowns.states, &mut self.errors);
        self.model.levels(&self.unknowns, &mut self.scratch);
        for (sample, error) in self.errors.iter_mut().enumerate() {
            let response = if sample < 2 { 0.0 } else { *error };
            *error = self.fit[sample] * (response + self.scratch[sample] - self.signal[sample]);
        }
    }

    /// The gradient of the cost, with the weights of the drivers in the scratch buffer.
    fn gradient_into_step(&mut self) {
        let states = &mut self.step.unknowns.states;
        states.fill(0.0);
        spread(&self.errors, AVERAGE, states);
        spread(&self.scratch, self.model.driver, states);
        self.model.level_sums(&self.errors, &mut self.step.unknowns);
        for (sum, spline) in self.step.unknowns.splines.iter_mut().zip(&self.unknowns.splines) {
            *sum += LEVEL_PENALTY * spline;
        }
    }

    fn factorise(&mut self) {
        self.factor.factorise(self.model, self.fit, &self.ratios, LEVEL_PENALTY);
    }

    /// Computes the search direction with the present centring.
    fn direction(&mut self) {
        for sample in self.bound() {
            let pull = self.ratios[sample] * self.missing[sample] - self.centring[sample];
            self.scratch[sample] = self.penalty + pull;
        }
        self.gradient_into_step();
        let Unknowns { states, splines, line } = &mut self.step.unknowns;
        let all = states.iter_mut().chain(splines).chain(line);
        all.for_each(|each| *each = -*each);
        self.factor.solve(self.model, &mut self.step.unknowns);
        self.model.drivers(&self.step.unknowns.states, &mut self.step.slacks);
        for sample in self.bound() {
            self.step.slacks[sample] += self.missing[sample];
            self.step.prices[sample] = self.centring[sample]
                - self.prices[sample]
                - self.ratios[sample] * self.step.slacks[sample];
        }
    }

    /// Makes one step; returns its length.
    fn advance(&mut self) -> f64 {
        self.factorise();
        self.direction();
        let length = self.longest_step();
        let (mut gap, mut next) = (0.0, 0.0);
        for sample in self.bound() {
            let (slack, price) = (self.slacks[sample], self.prices[sample]);
            gap += slack * price;
            let (slack, price) = (
                slack + length * self.step.slacks[sample],
                price + length * self.step.prices[sample],
            );
            next += slack * price;
        }
        let share: f64 = next / gap;
        let goal = share * share * share * gap / self.bound().len() as f64;
        for sample in self.bound() {
            let second_order = self.step.slacks[sample] * self.step.prices[sample];
            self.centring[sample] = (goal - second_order) / self.slacks[sample];
        }
        self.direction();
        let length = (SHARE * self.longest_step()).min(1.0);
        self.go(length);
        length
    }

    fn longest_step(&self) -> f64 {
        let mut length: f64 = 1.0 / SHARE;
        for sample in self.bound() {
            let (slack, price) = (self.step.slacks[sample], self.step.prices[sample]);
            if slack < 0.0 {
                length = length.min(-self.slacks[sample] / slack);
            }
            if price < 0.0 {
                length = length.min(-self.prices[sample] / price);
            }
        }
        length
    }

    fn go(&mut self, length: f64) {
        let add = |values: &mut [f64], steps: &[f64]| {
            values.iter_mut().zip(steps).for_each(|(value, step)| *value += length * step);
        };
        add(&mut self.unknowns.states, &self.step.unknowns.states);
        add(&mut self.unknowns.splines, &self.step.unknowns.splines);
        add(&mut self.unknowns.line, &self.step.unknowns.line);
        add(&mut self.slacks, &self.step.slacks);
        add(&mut self.prices, &self.step.prices);
    }
}

/// The transpose of the driver's filter: adds each value to the states that it depends on.
fn spread(values: &[f64], [now, before, earlier]: [f64; 3], states: &mut [f64]) {
    for (sample, value) in values.iter().enumerate().skip(2) {
        states[sample] += now * value;
        states[sample - 1] += before * value;
        states[sample - 2] += earlier * value;
    }
}
