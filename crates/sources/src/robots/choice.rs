//! The choice of what to watch of a robot: which topic becomes which stream.

use teampulse_core::registry::SettingsError;
use teampulse_core::stream::{Shape, Signal, Stream, Subject};

use super::{Field, Robots, norm, norm_of_type};
use crate::pattern::Pattern;

/// Which topics of which robots are watched, and as what.
#[derive(Clone, Debug)]
pub struct Choice {
    namespace: Option<Pattern>,
    prefix: String,
    mapped: Vec<(&'static str, Field)>,
    numbers: Vec<Field>,
    images: Vec<String>,
    topics: Vec<Pattern>,
}

impl Choice {
    /// The choice that a study makes.
    pub fn new(settings: &Robots) -> Result<Choice, SettingsError> {
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
            topics: settings.topics.iter().map(relative).collect::<Result<_, _>>()?,
        })
    }

    /// The robot that a topic belongs to, and the topic's name below it.
    pub fn robot<'a>(&'a self, topic: &'a str) -> Option<(&'a str, &'a str)> {
        let Some(namespace) = &self.namespace else {
            return Some((self.prefix.trim_matches('/'), topic.strip_prefix('/')?));
        };
        let (robot, relative) = namespace.split(topic)?;
        let last = robot.rsplit('/').next().unwrap_or(robot);
        let id = namespace.starred(robot).unwrap_or(last);
        (!relative.is_empty() && !id.is_empty()).then_some((id, relative))
    }

    /// What a topic of this type becomes; `None` when it is not wanted. The shape is still empty.
    pub fn stream(&self, topic: &str, type_name: &str) -> Option<Stream> {
        let (id, relative) = self.robot(topic)?;
        let mut stream = self.described(relative, type_name)?;
        stream.name = format!("{}{topic}", self.prefix);
        id.clone_into(&mut stream.id);
        relative.clone_into(&mut stream.device);
        Some(stream)
    }

    fn described(&self, relative: &str, type_name: &str) -> Option<Stream> {
        if let Some((parameter, field)) = self.mapped.iter().find(|(_, it)| it.topic == relative) {
            return Some(mapped(parameter, field));
        }
        if let Some(field) = self.numbers.iter().find(|it| it.topic == relative) {
            return Some(read(blank(), field));
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

    /// The stream of a standard type, unless the study has mapped this parameter elsewhere.
    fn standard(&self, type_name: &str) -> Option<Stream> {
        let norm = norm_of_type(type_name)?;
        if self.mapped.iter().any(|(parameter, _)| *parameter == norm.parameter) {
            return None;
        }
        let stream = Stream { signal: norm.signal, doc: norm.doc.into(), ..blank() };
        Some(stream.with_channels(norm.channels))
    }
}

fn blank() -> Stream {
    Stream::raw("", Subject::robot(""), Shape::Sample)
}

/// The stream of a parameter that the study maps to a topic.
fn mapped(parameter: &str, field: &Field) -> Stream {
    let norm = norm(parameter).expect("mapped parameters are those of the profile");
    let stream = Stream { signal: norm.signal, doc: norm.doc.into(), ..blank() };
    match field.field {
        Some(_) => read(stream, field),
        None => Stream {
            scale: field.scale,
            rate_hz: field.rate_hz.unwrap_or(0.0),
            ..stream.with_channels(norm.channels)
        },
    }
}

/// A stream from which the study reads one number.
fn read(stream: Stream, field: &Field) -> Stream {
    let path = field.field.as_deref().unwrap_or("data");
    let unit = field.unit.as_deref().unwrap_or("1");
    Stream {
        scale: field.scale,
        rate_hz: field.rate_hz.unwrap_or(0.0),
        ..stream.with_channels(&[(path, unit)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(settings: &str) -> Choice {
        Choice::new(&toml::from_str(settings).expect("settings")).expect("a choice")
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
        assert_eq!((battery.signal, &battery.units[..]), (Signal::Battery, &["J".to_owned()][..]));
        assert!(choice.stream("/r1/other", "sensor_msgs/msg/BatteryState").is_none());
        assert!(choice.stream("/r1/scan_raw", "sensor_msgs/msg/LaserScan").is_some());
    }
}
