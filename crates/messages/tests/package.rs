//! The package that ROS users build is the one that is shipped here.

use std::fs;
use std::path::Path;

use teampulse_messages::catalogue::{names, shipped};

#[test]
fn the_package_and_the_catalogue_have_the_same_messages() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../msgs/teampulse_msgs");
    let built = fs::read_to_string(package.join("CMakeLists.txt")).expect("a package is built");
    let files = fs::read_dir(package.join("msg")).expect("a package has messages");
    let mut found = Vec::new();
    for file in files {
        let path = file.expect("a readable folder").path();
        let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        assert!(built.contains(&format!("\"msg/{name}.msg\"")), "{name} is not built");
        let type_name = format!("teampulse_msgs/msg/{name}");
        let text = fs::read_to_string(path).expect("a readable file");
        let shipped = shipped(&type_name).expect("each message is shipped");
        assert!(shipped.text.starts_with(&text), "{name} is shipped in another form");
        found.push(type_name);
    }
    found.extend(built_services(&package, &built));
    found.sort();
    assert!(names().filter(|name| name.starts_with("teampulse_msgs/")).eq(found));
}

/// The messages of the package's services, each compared with the shipped one.
fn built_services(package: &Path, built: &str) -> Vec<String> {
    let mut found = Vec::new();
    for file in fs::read_dir(package.join("srv")).expect("a package has services") {
        let path = file.expect("a readable folder").path();
        let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        assert!(built.contains(&format!("\"srv/{name}.srv\"")), "{name} is not built");
        let text = fs::read_to_string(path).expect("a readable file");
        let (request, response) = text.split_once("---\n").expect("a service has two halves");
        for (half, text) in [("Request", request), ("Response", response)] {
            let type_name = format!("teampulse_msgs/srv/{name}_{half}");
            let shipped = shipped(&type_name).expect("each half is shipped");
            assert!(shipped.text.starts_with(text), "{type_name} is shipped in another form");
            found.push(type_name);
        }
    }
    found
}
