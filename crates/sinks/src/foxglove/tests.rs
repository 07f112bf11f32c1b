use super::*;
use crate::SINKS;

#[test]
fn a_port_and_origins_are_all_that_it_takes() {
    let settings: Foxglove = toml::from_str("").unwrap();
    assert_eq!((settings.port, settings.origins.len()), (8765, 0));
    let odd: Foxglove = toml::from_str("origins = [\"viewer\"]").unwrap();
    let context = SinkContext::new("bag", "test", teampulse_core::clock::Clock::settable());
    assert!(odd.build(&context).is_err());
    assert!(SINKS.iter().any(|entry| entry.kind == "foxglove"));
}
