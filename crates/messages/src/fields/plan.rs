use std::collections::BTreeMap;

use super::resolve::ResolvedPath;
use crate::cdr::{CdrError, Reader};
use crate::definition::{Count, Kind, Number, Struct};

/// The actions for the fields of a message, up to the last selected one.
#[derive(Clone, Debug)]
pub(super) struct Plan(Vec<Step>);

/// The action for one field.
#[derive(Clone, Debug)]
enum Step {
    /// Skips the field.
    Skip(Kind, Count),
    /// Reads the single value of the field.
    Read(Target),
    /// Reads the selected values of the field, in order of their indices.
    Pick { kind: Kind, count: Count, picks: Vec<(usize, Target)> },
}

/// The action for one value, with the index of the number in the output.
#[derive(Clone, Debug)]
enum Target {
    Number(Number, Vec<usize>),
    Text(Vec<usize>),
    WideText(Vec<usize>),
    Struct(Plan),
}

/// The rest of a path through a field or value, and its index in the output.
type Rest<'a> = (usize, &'a [(usize, Option<u64>)]);

impl Plan {
    /// Creates the plan for these paths; their numbers appear in the output in this order.
    pub fn new(root: &Struct, ways: &[ResolvedPath]) -> Plan {
        let wanted: Vec<Rest<'_>> = ways.iter().map(Vec::as_slice).enumerate().collect();
        let mut plan = Plan::of(root, &wanted);
        let last = plan.0.iter().rposition(|step| !matches!(step, Step::Skip(..)));
        plan.0.truncate(last.map_or(0, |last| last + 1));
        plan
    }

    fn of(within: &Struct, wanted: &[Rest<'_>]) -> Plan {
        let steps = within.fields.iter().enumerate().map(|(place, field)| {
            let mut one = Vec::new();
            let mut many = BTreeMap::<u64, Vec<Rest<'_>>>::new();
            for (slot, path) in wanted {
                match path.split_first() {
                    Some(((at, None), rest)) if *at == place => one.push((*slot, rest)),
                    Some(((at, Some(index)), rest)) if *at == place => {
                        many.entry(*index).or_default().push((*slot, rest));
                    }
                    _ => {}
                }
            }
            Step::of(&field.kind, field.count, &one, &many)
        });
        Plan(steps.collect())
    }

    /// Reads the selected values of the next message.
    pub fn read(&self, from: &mut Reader<'_>, out: &mut [f64]) -> Result<(), CdrError> {
        self.0.iter().try_for_each(|step| step.read(from, out))
    }
}

impl Step {
    fn of(
        kind: &Kind,
        count: Count,
        one: &[Rest<'_>],
        many: &BTreeMap<u64, Vec<Rest<'_>>>,
    ) -> Step {
        if !one.is_empty() {
            Step::Read(Target::of(kind, one))
        } else if many.is_empty() {
            Step::Skip(kind.clone(), count)
        } else {
            let picks = many.iter().map(|(index, ways)| (*index as usize, Target::of(kind, ways)));
            Step::Pick { kind: kind.clone(), count, picks: picks.collect() }
        }
    }

    fn read(&self, from: &mut Reader<'_>, out: &mut [f64]) -> Result<(), CdrError> {
        match self {
            Step::Skip(kind, count) => {
                let count = count.read(kind, from)?;
                kind.skip(count, from)
            }
            Step::Read(target) => target.read(from, out),
            Step::Pick { kind, count, picks } => {
                let count = count.read(kind, from)?;
                let mut next = 0;
                for (index, target) in picks.iter().take_while(|(index, _)| *index < count) {
                    kind.skip(index - next, from)?;
                    target.read(from, out)?;
                    next = index + 1;
                }
                kind.skip(count - next, from)
            }
        }
    }
}

impl Target {
    fn of(kind: &Kind, ways: &[Rest<'_>]) -> Target {
        let slots = || ways.iter().map(|(slot, _)| *slot).collect();
        match kind {
            Kind::Number(number) => Target::Number(*number, slots()),
            Kind::Text(_) => Target::Text(slots()),
            Kind::WideText(_) => Target::WideText(slots()),
            Kind::Struct(nested) => Target::Struct(Plan::of(nested, ways)),
        }
    }

    fn read(&self, from: &mut Reader<'_>, out: &mut [f64]) -> Result<(), CdrError> {
        let (number, slots) = match self {
            Target::Struct(plan) => return plan.read(from, out),
            Target::Number(number, slots) => (number.read(from)?, slots),
            Target::Text(slots) => (spelled(std::str::from_utf8(from.text()?).ok()), slots),
            Target::WideText(slots) => (spelled(Some(&from.wide_text()?)), slots),
        };
        for slot in slots {
            out[*slot] = number;
        }
        Ok(())
    }
}

/// Parses a text as a number; NaN if it is not one.
fn spelled(text: Option<&str>) -> f64 {
    text.and_then(|text| text.trim().parse().ok()).unwrap_or(f64::NAN)
}
