use super::*;

#[test]
fn without_a_device_and_a_display_the_error_says_what_to_do() {
    let nodes = Nodes::new(vec![Kind::Keyboard], Vec::new());
    let SourceError::Gone { message, hint } =
        nodes.lacking("failed to open the X11 display :9: refused")
    else {
        panic!("it may come back")
    };
    assert_eq!(
        message,
        "read inputs: /dev/input has none of the requested devices, and failed to open the X11 display :9: refused"
    );
    assert!(hint.contains("teampulse scan"), "{hint}");
}

#[tokio::test]
async fn a_display_that_is_not_there_is_an_error() {
    let error = Display::open(Some(":4711".into()), &[]).await.err().expect("it is not there");
    assert!(error.starts_with("open the X11 display :4711: "), "{error}");
}
