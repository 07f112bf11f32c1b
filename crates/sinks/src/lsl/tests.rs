use teampulse_core::stream::{Shape, Subject};

use super::*;

#[test]
fn a_stream_is_described_in_lsl_s_terms() {
    let subject = Subject::person("p001");
    let mut ecg = Stream::raw("/humans/persons/p001/polar_h10/ecg", subject, Shape::Wave)
        .with_channels(&[("ecg", "uV")]);
    ecg.signal = teampulse_core::stream::Signal::Ecg;
    ecg.rate_hz = 130.0;
    let info = described::info(&ecg, Format::Float32, "pilot").expect("has numbers");
    assert_eq!((info.kind.as_str(), info.rate_hz, info.format), ("ECG", 130.0, Format::Float32));
    assert_eq!((info.channels[0].label.as_str(), info.channels[0].unit.as_str()), ("ecg", "uV"));
    assert_eq!(info.source_id, "teampulse:pilot:/humans/persons/p001/polar_h10/ecg");
    let events = Stream::raw("/session/events", Subject::session(), Shape::Event);
    let info = described::info(&events, Format::Float32, "pilot").expect("has texts");
    assert_eq!((info.kind.as_str(), info.format), ("Markers", Format::String));
    let status = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    assert_eq!(described::info(&status, Format::Float32, "pilot"), None);
}

#[test]
fn mistakes_in_settings_are_named_at_their_place() {
    let context = SinkContext::new("/tmp/none", "test", Clock::settable());
    for (settings, place) in
        [("streams = []", "streams"), ("streams = [\"/a\", \"b\"]", "streams.1")]
    {
        let settings: Lsl = toml::from_str(settings).expect("settings");
        let error = settings.build(&context).err().expect("is wrong");
        assert_eq!(error.path, place);
    }
}
