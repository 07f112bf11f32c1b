//! Any bytes as the descriptor of a model, and any numbers as what comes out of one: a reading or an error, never a
//! panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_vision::model::descriptor::Descriptor;
use teampulse_vision::model::ready::READY;
use teampulse_vision::model::tensor::Tensor;

fuzz_target!(|bytes: &[u8]| {
    let _ = std::str::from_utf8(bytes).map(Descriptor::parse);
    let [first, second, third, numbers @ ..] = bytes else { return };
    let (quads, _) = numbers.as_chunks::<4>();
    let values: Vec<f32> = quads.iter().map(|quad| f32::from_le_bytes(*quad)).collect();
    let shape = [1, usize::from(*first), usize::from(*second)];
    let count = shape.iter().product();
    let values: Vec<f32> = values.iter().copied().chain(std::iter::repeat(0.5)).take(count).collect();
    let Some(output) = Tensor::new("output", &shape, values) else { return };
    for ready in READY {
        let Ok(descriptor) = Descriptor::parse(ready.text) else { continue };
        let outputs = vec![output.clone(); usize::from(*third % 4)];
        let found = descriptor.output.decode(&outputs, descriptor.input.size).ok();
        let _ = descriptor.output.values(found.as_ref());
    }
});
