//! Decides which topics of a robot become which streams.

use teampulse_core::registry::SettingsError;
use teampulse_core::stream::{Channel, Shape, Signal, Stream, Subject};
use teampulse_core::units::spelt;
use teampulse_messages::fields::Path;

use super::{Field, Robots, norm, norm_of_type};
use crate::faces::Faces;
use crate::simulated::TRUTH;
use teampulse_core::pattern::Pattern;

/// Which topics of which robots are watched, and as which streams.
#[derive(Clone, Debug)]
pub struct Choice {
    namespace: Option<Pattern>,
    prefix: String,
    mapped: Vec<(&'static str, Field)>,
    numbers: Vec<Field>,
    images: Vec<String>,
    faces: Faces,
    commands: Vec<String>,
    topics: Vec<Pattern>,
}

impl Choice {
    /// Creates the choice that a study makes.
    pub fn new(settings: &Robots) -> Result<Choice, SettingsError> {
        check_commands(settings)?;
        check_fields(settings)?;
        check_units(settings)?;
        check_namespace(settings)?;
        let wide = settings.namespace == "/";
        if wide && settings.prefix.is_none() {
            return Err(SettingsError::new("robots without a namespace need a `prefix`")
                .with_hint("add a line like `prefix = \"/r5\"`"));
        }
        let pattern = |text: &str| Pattern::parse(text).map_err(SettingsError::new);
        let relative = |topic: &String| pattern(&format!("/{}", topic.trim_start_matches('/')));
        Ok(Choice {
            namespace: if wide { None } else { Some(pattern(&settings.namespace)?) },
            prefix: settings.prefix.as_ref().map_or_else(String::new, |each| each.text().into()),
            mapped: settings
                .mapped()
                .into_iter()
                .map(|(key, field)| (key, field.clone()))
                .collect(),
            numbers: settings.numbers.clone(),
            images: settings.images.clone(),
            faces: settings.faces,
            commands: settings.commands.clone(),
            topics: settings.topics.iter().map(relative).collect::<Result<_, _>>()?,
        })
    }

    /// Returns the robot that a topic belongs to, and the topic's name below the robot's namespace.
    pub fn robot<'a>(&'a self, topic: &'a str) -> Option<(&'a str, &'a str)> {
        let Some(namespace) = &self.namespace else {
            return Some((self.prefix.trim_matches('/'), topic.strip_prefix('/')?));
        };
        // The simulator's ground truth belongs to no robot, unless the study names it.
        if !namespace.is_rooted() && topic.starts_with(TRUTH) {
            return None;
        }
        let (id, relative) = namespace.subject(topic)?;
        (!relative.is_empty() && !id.is_empty()).then_some((id, relative))
    }

    /// Returns the stream that a topic of this type becomes, still without its shape; `None` if it is not wanted.
    pub fn stream(&self, topic: &str, type_name: &str) -> Option<Stream> {
        let (id, relative) = self.robot(topic)?;
        let mut stream = self.described(relative, type_name)?;
        stream.name = format!("{}{topic}", self.prefix);
        id.clone_into(&mut stream.id);
        relative.clone_into(&mut stream.device);
        let is_image = self.images.iter().any(|image| image == relative);
        Some(if is_image {
            self.faces.hidden_in(stream)
        } else {
            self.faces.hidden_in_any(stream, type_name)
        })
    }

    /// Returns the stream of a topic by its type, with the numbers that the study additionally reads from it.
    fn described(&self, relative: &str, type_name: &str) -> Option<Stream> {
        let mut numbers = self.numbers.iter().filter(|field| field.topic == relative).peekable();
        let wanted = numbers.peek().is_some().then(blank);
        let mut stream = self.in_itself(relative, type_name).or(wanted)?;
        numbers.for_each(|field| add(&mut stream, field));
        Some(stream)
    }

    fn in_itself(&self, relative: &str, type_name: &str) -> Option<Stream> {
        if let Some((parameter, field)) = self.mapped.iter().find(|(_, it)| it.topic == relative) {
            return Some(mapped(parameter, field));
        }
        if self.commands.iter().any(|each| each == relative) {
            if norm_of_type(type_name).is_none() {
                return Some(commands());
            }
            tracing::warn!(
                "{relative} does not count as a command: its type {type_name} carries the robot's state"
            );
        }
        if self.images.iter().any(|image| image == relative) {
            return Some(Stream { signal: Signal::Image, ..blank() });
        }
        if let Some(standard) = self.standard(type_name) {
            return Some(standard);
        }
        let path = format!("/{relative}");
        self.topics.iter().any(|each| each.matches(&path)).then(blank)
    }

    /// Returns the stream of a standard type, unless the study maps this parameter to another topic.
    fn standard(&self, type_name: &str) -> Option<Stream> {
        let norm = norm_of_type(type_name)?;
        if self.mapped.iter().any(|(parameter, _)| *parameter == norm.parameter) {
            return None;
        }
        let stream = Stream { signal: norm.signal, doc: norm.doc.into(), ..blank() };
        Some(stream.with_channels(norm.channels))
    }
}

/// Returns the stream of a topic on which people command a robot.
fn commands() -> Stream {
    let doc = "people's commands to the robot".into();
    Stream { signal: Signal::Input, doc, ..blank() }
}

fn blank() -> Stream {
    Stream::raw("", Subject::robot(""), Shape::Sample)
}

/// Returns the stream of a parameter that the study maps to a topic.
fn mapped(parameter: &str, field: &Field) -> Stream {
    let norm = norm(parameter).expect("mapped parameters are those of the profile");
    let stream = Stream { signal: norm.signal, doc: norm.doc.into(), ..blank() };
    if field.field.is_some() {
        let mut stream = stream;
        add(&mut stream, field);
        return stream;
    }
    let mut stream = stream.with_channels(norm.channels);
    stream.channels.iter_mut().for_each(|channel| channel.scale = field.scale);
    Stream { rate_hz: field.rate_hz.unwrap_or(0.0), ..stream }
}

/// Adds a channel that reads one more number from a stream's messages.
fn add(stream: &mut Stream, field: &Field) {
    let name = field.field.clone().unwrap_or_else(|| "data".into());
    let unit = field.unit.clone().unwrap_or_else(|| "1".into());
    stream.channels.push(Channel { name, unit, scale: field.scale });
    stream.rate_hz = field.rate_hz.unwrap_or(stream.rate_hz);
}

/// Checks that each command is a full topic name and not a topic with the robot's state.
fn check_commands(settings: &Robots) -> Result<(), SettingsError> {
    for (place, topic) in settings.commands.iter().enumerate() {
        let wrong = |message: String, hint: &str| {
            Err(SettingsError::new(message).with_hint(hint).at(format!("commands.{place}")))
        };
        if !is_relative_name(topic) {
            let message = format!("`{topic}` is not the name of a topic relative to the robot");
            return wrong(message, "give the full name without a leading slash, like `goal_pose`");
        }
        if let Some((parameter, _)) = settings.mapped().iter().find(|(_, it)| it.topic == *topic) {
            let message = format!("`{topic}` can't be a command: it is mapped as `{parameter}`");
            return wrong(message, "a topic is either the robot's state or a command");
        }
        if settings.images.contains(topic) {
            let message = format!("`{topic}` can't be a command: it is among the `images`");
            return wrong(message, "a topic is either the robot's state or a command");
        }
    }
    Ok(())
}

/// Checks that ROS allows the namespace: only letters, digits, `_`, stars and slashes.
fn check_namespace(settings: &Robots) -> Result<(), SettingsError> {
    let fits = |each: char| each.is_ascii_alphanumeric() || "_*/".contains(each);
    if settings.namespace.chars().all(fits) {
        return Ok(());
    }
    let message = format!("`{}` is not a ROS namespace", settings.namespace);
    let hint = "use letters, digits and `_`, with `*` for any part of a token: `/robot*`";
    Err(SettingsError::new(message).with_hint(hint).at("namespace"))
}

/// Whether ROS allows this name below a namespace: tokens of letters, digits and `_` that do not begin with a digit.
fn is_relative_name(name: &str) -> bool {
    let fits = |each: char| each.is_ascii_alphanumeric() || each == '_';
    name.split('/').all(|token| {
        !token.is_empty()
            && !token.starts_with(|first: char| first.is_ascii_digit())
            && !token.contains("__")
            && token.chars().all(fits)
    })
}

/// Checks that each field is a valid path; whether a message has that field depends on its type.
fn check_fields(settings: &Robots) -> Result<(), SettingsError> {
    let mapped = settings.mapped().into_iter();
    let mapped = mapped.map(|(parameter, field)| (format!("{parameter}.field"), field));
    let numbers = settings.numbers.iter().enumerate();
    let numbers = numbers.map(|(place, field)| (format!("numbers.{place}.field"), field));
    for (place, field) in mapped.chain(numbers) {
        let Some(path) = &field.field else { continue };
        if path.parse::<Path>().is_err() {
            let message = format!("`{path}` is not the path to a field of a message");
            return Err(SettingsError::new(message)
                .with_hint("separate names by dots, and number values from 0: `status[0].level`")
                .at(place));
        }
    }
    Ok(())
}

/// Checks that each number mapped to a parameter has a unit in which that parameter can be judged.
fn check_units(settings: &Robots) -> Result<(), SettingsError> {
    for (parameter, field) in settings.mapped() {
        let Some(unit) = field.unit.as_ref().filter(|_| field.field.is_some()) else { continue };
        let units = norm(parameter).map_or(&[][..], |norm| norm.units);
        if !units.is_empty() && !units.contains(&spelt(unit).as_str()) {
            let message = format!("`{parameter}` can't be judged by a number in `{unit}`");
            let hint = format!(
                "use one of {}; `scale` is the conversion factor, such as 3600 from Wh to J",
                units.join(", ")
            );
            return Err(SettingsError::new(message)
                .with_hint(hint)
                .at(format!("{parameter}.unit")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(settings: &str) -> Choice {
        Choice::new(&toml::from_str(settings).expect("settings")).expect("a choice")
    }

    #[test]
    fn each_number_of_a_topic_has_a_scale_of_its_own() {
        let choice = choice(
            r#"numbers = [
                { topic = "battery_state", field = "current", unit = "A", scale = 0.001 },
                { topic = "battery_state", field = "design_capacity", unit = "Ah", scale = 3600 },
            ]"#,
        );
        let stream = choice.stream("/r1/battery_state", "sensor_msgs/msg/BatteryState");
        let channels = stream.expect("a stream").channels;
        for (name, unit, scale) in [("current", "A", 0.001), ("design_capacity", "Ah", 3600.0)] {
            let expected = Channel { name: name.into(), unit: unit.into(), scale };
            assert!(channels.contains(&expected), "{channels:?}");
        }
    }

    #[test]
    fn a_namespace_that_ros_can_t_have_is_refused() {
        for wrong in ["/robot 1", "/robot-1", "/größe*"] {
            let settings = Robots { namespace: wrong.into(), ..Robots::default() };
            assert_eq!(Choice::new(&settings).expect_err(wrong).path, "namespace");
        }
    }

    #[test]
    fn the_truth_of_the_simulator_is_no_robot_unless_it_is_named() {
        let is_taken = |namespace: &str| {
            let choice = choice(&format!("namespace = \"{namespace}\""));
            let truth = "/sim/truth/robot1/battery_state";
            choice.stream(truth, "sensor_msgs/msg/BatteryState").is_some()
        };
        assert!(!is_taken("/*") && is_taken("/sim/truth/*"));
    }

    #[test]
    fn a_battery_in_a_unit_that_none_has_is_refused() {
        let unit = |unit: &str| {
            let text =
                format!(r#"battery = {{ topic = "battery", field = "data", unit = "{unit}" }}"#);
            Choice::new(&toml::from_str(&text).expect("settings")).map(|_| ())
        };
        assert!(["J", "V", "%", "Ah"].into_iter().all(|each| unit(each).is_ok()));
        for wrong in ["furlong", "mWh", "m"] {
            let error = unit(wrong).expect_err(wrong).to_string();
            assert!(error.contains(wrong), "{error}");
        }
    }

    #[test]
    fn a_field_that_no_message_can_have_is_reported_in_its_place() {
        let of = |settings: &str| Choice::new(&toml::from_str(settings).expect("settings"));
        let number = |field| format!("numbers = [{{ topic = \"arm\", field = \"{field}\" }}]");
        for wrong in ["effort[", "effort[a]", "", "a..b", "effort [0]"] {
            let error = of(&number(wrong)).expect_err(wrong).to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            let battery = format!("battery = {{ topic = \"b\", field = \"{wrong}\" }}");
            assert!(of(&battery).is_err(), "{wrong}");
        }
        assert!(of(&number("status[0].values[2].value")).is_ok());
    }

    #[test]
    fn robots_are_found_by_namespace_and_type() {
        let choice = choice(r#"namespace = "/robot*""#);
        let battery = choice.stream("/robot3/power/state", "sensor_msgs/msg/BatteryState");
        let battery = battery.expect("any topic of the type is a battery");
        assert_eq!((battery.id.as_str(), battery.signal), ("robot3", Signal::Battery));
        assert_eq!(battery.device, "power/state");
        assert!(choice.stream("/drone1/odom", "nav_msgs/msg/Odometry").is_none());
        assert!(choice.stream("/robot3/camera", "sensor_msgs/msg/Image").is_none());
    }

    #[test]
    fn settings_describe_the_streams_of_their_robots_and_no_others() {
        let settings = |text: &str| toml::from_str::<Robots>(text).expect("settings");
        let temperature = |text: &str, topic: &str| {
            let stream = choice(text).stream(topic, "sensor_msgs/msg/Temperature");
            stream.expect("a robot's temperature")
        };
        let one = temperature(r#"namespace = "/robot*""#, "/robot1/temperature");
        assert!(settings(r#"namespace = "/robot*""#).describe(&one));
        assert!(!settings(r#"namespace = "/alpha*""#).describe(&one));
        let wide = "namespace = \"/\"\nprefix = \"/r5\"";
        assert!(settings(wide).describe(&temperature(wide, "/temperature")));
        assert!(!settings(wide).describe(&one));
    }

    #[test]
    fn a_robot_without_a_namespace_is_given_one() {
        let choice = choice("namespace = \"/\"\nprefix = \"/r5\"");
        let odometry = choice.stream("/odom", "nav_msgs/msg/Odometry").expect("watched");
        assert_eq!((odometry.name.as_str(), odometry.id.as_str()), ("/r5/odom", "r5"));
        let settings: Robots = toml::from_str("namespace = \"/\"").expect("settings");
        assert!(Choice::new(&settings).is_err());
    }

    #[test]
    fn a_battery_in_joules_fits_too() {
        let choice = choice(
            r#"battery = { topic = "battery_sensor/value", field = "data", unit = "J" }
               topics = ["scan*"]"#,
        );
        let battery = choice.stream("/r1/battery_sensor/value", "webots_ros/msg/Float64Stamped");
        let battery = battery.expect("mapped");
        assert_eq!((battery.signal, battery.channels[0].unit.as_str()), (Signal::Battery, "J"));
        assert!(choice.stream("/r1/other", "sensor_msgs/msg/BatteryState").is_none());
        assert!(choice.stream("/r1/scan_raw", "sensor_msgs/msg/LaserScan").is_some());
    }

    #[test]
    fn commands_are_what_people_put_in_and_never_in_the_way_of_a_parameter() {
        let choice = choice(
            r#"commands = ["goal_pose", "cmd_vel", "odom", "battery_state"]
               battery  = { topic = "battery" }"#,
        );
        let signal = |topic, type_name| Some(choice.stream(topic, type_name)?.signal);
        assert_eq!(signal("/r1/goal_pose", "geometry_msgs/msg/PoseStamped"), Some(Signal::Input));
        assert_eq!(signal("/r1/cmd_vel", "geometry_msgs/msg/Twist"), Some(Signal::Input));
        assert_eq!(signal("/r1/battery_state", "sensor_msgs/msg/BatteryState"), None);
        assert_eq!(signal("/r1/odom", "nav_msgs/msg/Odometry"), Some(Signal::Odometry));
        assert_eq!(signal("/r1/battery", "sensor_msgs/msg/BatteryState"), Some(Signal::Battery));
        assert_eq!(signal("/r1/other", "geometry_msgs/msg/Twist"), None);
    }

    #[test]
    fn a_command_that_is_no_topic_of_its_own_is_reported_in_its_place() {
        for wrong in [
            "",
            "*",
            "cmd_*",
            "**",
            "/goal_pose",
            "goal_pose/",
            "a//b",
            "goal pose",
            "~/goal",
            "9a",
            "zone-a",
            "goal__pose",
            "größe",
            "battery/value",
            "camera",
        ] {
            let settings = Robots {
                commands: vec!["goal_pose".into(), wrong.into()],
                images: vec!["camera".into()],
                ..toml::from_str(r#"battery = { topic = "battery/value" }"#).expect("settings")
            };
            let error = Choice::new(&settings).expect_err(wrong);
            assert_eq!(error.path, "commands.1");
            assert!(error.message.starts_with(&format!("`{wrong}`")), "{error}");
            assert!(!error.hint.is_empty());
        }
        choice(r#"commands = ["goal_pose", "base/cmd_vel", "_hidden", "MoveTo2"]"#);
    }

    #[test]
    fn numbers_are_read_beside_what_a_topic_is_in_itself() {
        let choice = choice(
            r#"numbers = [
                 { topic = "battery", field = "cell_voltage[0]", unit = "V" },
                 { topic = "arm", field = "effort[0]", unit = "N m" },
                 { topic = "arm", field = "effort[1]", unit = "N m" },
               ]"#,
        );
        let battery = choice.stream("/r1/battery", "sensor_msgs/msg/BatteryState");
        let battery = battery.expect("watched");
        assert_eq!((battery.signal, battery.channels.len()), (Signal::Battery, 7));
        let arm = choice.stream("/r1/arm", "sensor_msgs/msg/JointState").expect("watched");
        let effort = |k| Channel::new(format!("effort[{k}]"), "N m");
        assert_eq!(arm.channels, [effort(0), effort(1)]);
    }
}
