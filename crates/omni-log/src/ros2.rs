//! The types of the ROS 2 messages in a log, and their definitions.
//!
//! Lengths are in metres, angles in radians, times in nanoseconds of simulated time. x is forward, y is left,
//! z is up, counter-clockwise is positive.

mod diagnostics;
mod geometry;
mod inertial;
mod sensors;

use byteorder::LittleEndian;
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use geometry::{
    Header, Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Time,
    Transform, TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
pub use inertial::{Clock, Imu};
use omni_sim::{LOGGED_SIGNALS, WheelSignal};
pub use sensors::Sensors;
use serde::{Deserialize, Serialize};

/// Encapsulation header of little-endian plain CDR; alignment counts from behind it.
pub(crate) const CDR_LE: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// Length of that header \[bytes\].
#[cfg(feature = "ros2")]
pub(crate) const HEADER: usize = CDR_LE.len();

/// A message that can have a topic of its own.
pub trait RosMessage: Clone + Serialize {
    /// Full ROS 2 type name, such as `geometry_msgs/msg/Twist`.
    const TYPE: &'static str;

    /// The `ros2msg` definition of the type followed by the definitions of all types that it contains.
    fn schema() -> &'static str;

    /// The names of the frames in it; those that are unused are empty.
    fn frames(&mut self) -> Vec<&mut String> {
        Vec::new()
    }
}

/// Replaces the content of `buffer` by the message in little-endian CDR, encapsulation header included.
///
/// # Errors
/// [`cdr_encoding::Error`] if a value has no CDR form; no message of this module has such a value.
///
/// ```
/// use omni_log::ros2::{StringMessage, encode_into};
/// let mut buffer = vec![9; 100]; // used before
/// encode_into(&StringMessage { data: "ab".into() }, &mut buffer)?;
/// // Little-endian CDR; a string is its length with the final zero, and its bytes.
/// assert_eq!(buffer, [&[0, 1, 0, 0, 3, 0, 0, 0], b"ab\0".as_slice()].concat());
/// # Ok::<(), cdr_encoding::Error>(())
/// ```
pub fn encode_into<M: RosMessage>(message: &M, buffer: &mut Vec<u8>) -> Result<(), cdr_encoding::Error> {
    buffer.clear();
    buffer.extend_from_slice(&CDR_LE);
    cdr_encoding::to_writer::<M, LittleEndian, _>(buffer, message)
}

/// The message in little-endian CDR, encapsulation header included.
///
/// # Errors
/// As [`encode_into`].
///
/// ```
/// use omni_log::ros2::{StringMessage, encode};
/// assert_eq!(encode(&StringMessage { data: "ab".into() })?.len(), 4 + 4 + 3);
/// # Ok::<(), cdr_encoding::Error>(())
/// ```
pub fn encode<M: RosMessage>(message: &M) -> Result<Vec<u8>, cdr_encoding::Error> {
    let mut buffer = Vec::new();
    encode_into(message, &mut buffer)?;
    Ok(buffer)
}

macro_rules! ros_messages {
    ($($message:ty => $name:literal, $file:literal, |$of:ident| $frames:expr;)+) => {$(
        impl RosMessage for $message {
            const TYPE: &'static str = $name;

            fn schema() -> &'static str {
                include_str!(concat!("schemas/", $file))
            }

            fn frames(&mut self) -> Vec<&mut String> {
                let $of = self;
                $frames
            }
        }
    )+};
}

ros_messages! {
    Twist => "geometry_msgs/msg/Twist", "Twist.msg", |_none| Vec::new();
    TwistStamped => "geometry_msgs/msg/TwistStamped", "TwistStamped.msg", |m| vec![&mut m.header.frame_id];
    TfMessage => "tf2_msgs/msg/TFMessage", "TFMessage.msg",
        |m| m.transforms.iter_mut().flat_map(|one| [&mut one.header.frame_id, &mut one.child_frame_id]).collect();
    JointState => "sensor_msgs/msg/JointState", "JointState.msg", |m| vec![&mut m.header.frame_id];
    Odometry => "nav_msgs/msg/Odometry", "Odometry.msg",
        |m| vec![&mut m.header.frame_id, &mut m.child_frame_id];
    PoseStamped => "geometry_msgs/msg/PoseStamped", "PoseStamped.msg", |m| vec![&mut m.header.frame_id];
    PoseWithCovarianceStamped => "geometry_msgs/msg/PoseWithCovarianceStamped",
        "PoseWithCovarianceStamped.msg", |m| vec![&mut m.header.frame_id];
    Path => "nav_msgs/msg/Path", "Path.msg", |m| {
        let poses = m.poses.iter_mut().map(|pose| &mut pose.header.frame_id);
        std::iter::once(&mut m.header.frame_id).chain(poses).collect()
    };
    StringMessage => "std_msgs/msg/String", "String.msg", |_none| Vec::new();
    MarkerArray => "visualization_msgs/msg/MarkerArray", "MarkerArray.msg",
        |m| m.markers.iter_mut().map(|marker| &mut marker.header.frame_id).collect();
    VehicleState => "omnistep_msgs/msg/VehicleState", "VehicleState.msg", |m| vec![&mut m.header.frame_id];
    Sensors => "omnistep_msgs/msg/Sensors", "Sensors.msg", |m| vec![&mut m.header.frame_id];
    ControllerSignals => "omnistep_msgs/msg/ControllerSignals", "ControllerSignals.msg",
        |m| vec![&mut m.header.frame_id];
    Clock => "rosgraph_msgs/msg/Clock", "Clock.msg", |_none| Vec::new();
    DiagnosticArray => "diagnostic_msgs/msg/DiagnosticArray", "DiagnosticArray.msg",
        |m| vec![&mut m.header.frame_id];
    Imu => "sensor_msgs/msg/Imu", "Imu.msg", |m| vec![&mut m.header.frame_id];
}

/// `nav_msgs/msg/Path`: a way, as poses one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// Time, and the frame of the way.
    pub header: Header,
    /// The poses.
    pub poses: Vec<PoseStamped>,
}

/// `tf2_msgs/msg/TFMessage`: transforms of one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TfMessage {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

/// `sensor_msgs/msg/JointState`: state of the joints; each of the three arrays is as long as `name`, or empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointState {
    /// Time; the frame is unused.
    pub header: Header,
    /// Names of the joints, as in the URDF.
    pub name: Vec<String>,
    /// Positions \[rad or m\].
    pub position: Vec<f64>,
    /// Velocities \[rad/s or m/s\].
    pub velocity: Vec<f64>,
    /// Torques or forces \[N m or N\].
    pub effort: Vec<f64>,
}

/// `nav_msgs/msg/Odometry`: pose in the header's frame, twist in the child's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Time, and the frame of the pose.
    pub header: Header,
    /// The frame of the twist, which moves with the vehicle.
    pub child_frame_id: String,
    /// Pose of the child in the header's frame.
    pub pose: PoseWithCovariance,
    /// Twist in the child's frame.
    pub twist: TwistWithCovariance,
}

/// `std_msgs/msg/String`: a text, such as a URDF.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StringMessage {
    /// The text, without zero characters.
    pub data: String,
}

/// `std_msgs/msg/ColorRGBA`: parts of 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorRgba {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// 1 is opaque.
    pub a: f32,
}

/// `visualization_msgs/msg/Marker`: a shape to draw, named by `ns` and `id`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Time, and the frame of pose and points.
    pub header: Header,
    /// Name of a group of markers.
    pub ns: String,
    /// Its number within the group.
    pub id: i32,
    /// Kind of shape: [`Marker::ARROW`].
    pub kind: i32,
    /// [`Marker::ADD`], [`Marker::DELETE`] or [`Marker::DELETE_ALL`].
    pub action: i32,
    /// Where it is.
    pub pose: Pose,
    /// Of an arrow between two points: diameters of shaft and head, length of the head \[m\].
    pub scale: Vector3,
    /// Its colour.
    pub color: ColorRgba,
    /// Its lifetime; 0 is unlimited. Seconds and nanoseconds, as a time has.
    pub lifetime: Time,
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// Of an arrow: its start and its end \[m\].
    pub points: Vec<Point>,
    pub(crate) colors: Vec<ColorRgba>,
    pub(crate) texture_resource: String,
    pub(crate) texture: (Header, String, Vec<u8>),
    pub(crate) uv_coordinates: Vec<(f32, f32)>,
    /// A text to draw.
    pub text: String,
    pub(crate) mesh_resource: String,
    pub(crate) mesh_file: (String, Vec<u8>),
    pub(crate) mesh_use_embedded_materials: bool,
}

impl Marker {
    /// The kind of an arrow.
    pub const ARROW: i32 = 0;
    /// Draws it, or changes it.
    pub const ADD: i32 = 0;
    /// Takes it away.
    pub const DELETE: i32 = 2;
    /// Takes all away, of every group.
    pub const DELETE_ALL: i32 = 3;
}

/// `visualization_msgs/msg/MarkerArray`: shapes to draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// The shapes.
    pub markers: Vec<Marker>,
}

/// `omnistep_msgs/msg/WheelState`: one wheel and its controller, a `float64` for each signal of
/// [`WheelSignal::logged`](omni_sim::WheelSignal::logged).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WheelState {
    /// Name, as in the vehicle file.
    pub name: String,
    /// The signals, in their order; NaN is unknown.
    pub signals: [f64; LOGGED_SIGNALS],
}

impl WheelState {
    /// A signal by its name; NaN if none is named so.
    #[must_use]
    pub fn signal(&self, name: &str) -> f64 {
        let place = WheelSignal::logged()
            .iter()
            .position(|signal| signal.name == name);
        place.map_or(f64::NAN, |place| self.signals[place])
    }
}

/// `omnistep_msgs/msg/VehicleState`: what was asked of the controller and what it did in one control period.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct VehicleState {
    /// End of the control period, and the frame of `estimated_twist`.
    pub header: Header,
    /// Coordination of the wheels when one saturates.
    pub policy: String,
    /// Twist that was asked for, in the body frame \[m/s, rad/s\], before heading hold and limits.
    pub asked_twist: Twist,
    /// Common factor put on all wheels \[1\], 0 to 1; 1 if no wheel holds the others back.
    pub common_factor: f64,
    /// Least-squares twist of the measured wheel velocities at the start of the period, in the body
    /// frame \[m/s, rad/s\].
    pub estimated_twist: Twist,
    /// One entry per wheel, in the order of the vehicle file.
    pub wheels: Vec<WheelState>,
}

/// `omnistep_msgs/msg/ControllerSignals`: signals that only this run's controller has, in one control period.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ControllerSignals {
    /// End of the control period; the frame is unused.
    pub header: Header,
    /// Names of the signals, the same in every message.
    pub name: Vec<String>,
    /// Their values, in the units that the names say; NaN if one is not known.
    pub value: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Header, strings with padding behind them, and doubles aligned to 8 from behind the encapsulation header.
    #[test]
    fn cdr_is_that_computed_by_hand() {
        let message = TwistStamped {
            header: Header::new(2_000_000_003, "ab"),
            twist: Twist {
                linear: Vector3 {
                    x: 1.0,
                    y: -2.0,
                    z: 0.0,
                },
                angular: Vector3 {
                    x: 0.0,
                    y: 0.0,
                    z: 0.5,
                },
            },
        };
        let mut expected = vec![0, 1, 0, 0]; // little-endian CDR
        expected.extend([2, 0, 0, 0, 3, 0, 0, 0]); // sec, nanosec
        expected.extend([3, 0, 0, 0, b'a', b'b', 0]); // length with the final zero, text
        expected.push(0); // 15 bytes so far, and a double starts at a multiple of 8
        expected.extend([0, 0, 0, 0, 0, 0, 0xf0, 0x3f]); // 1.0
        expected.extend([0, 0, 0, 0, 0, 0, 0x00, 0xc0]); // -2.0
        expected.extend([0; 24]);
        expected.extend([0, 0, 0, 0, 0, 0, 0xe0, 0x3f]); // 0.5
        assert_eq!(encode(&message).expect("encodes"), expected);
    }

    #[test]
    fn covariances_have_no_length_prefix() {
        // stamp 8, two empty strings 2 x 5 with 3 of padding between, 3 before the doubles, 7 + 36 + 6 + 36 doubles
        let bytes = encode(&Odometry::default()).expect("encodes");
        assert_eq!(bytes.len(), 4 + 8 + 5 + 3 + 5 + 3 + (7 + 36 + 6 + 36) * 8);
    }

    #[test]
    fn a_wheel_in_the_message_has_the_signals_of_the_table() {
        let fields =
            WheelSignal::logged().map(|signal| format!("# {}\nfloat64 {}\n", signal.doc.trim(), signal.name));
        let (fields, schema) = (fields.concat(), VehicleState::schema());
        let start = schema.find("string name\n").expect("its first field") + "string name\n".len();
        assert_eq!(
            &schema[start..],
            fields,
            "these lines belong into schemas/VehicleState.msg"
        );
    }

    #[test]
    fn a_vehicle_state_comes_back_as_it_was() {
        let wheel = |first| {
            let mut signals = [0.5; LOGGED_SIGNALS];
            signals[0] = first;
            WheelState {
                name: "front".into(),
                signals,
            }
        };
        let wheels = vec![wheel(0.25), wheel(-3.5)];
        let message = VehicleState {
            policy: "shared".into(),
            common_factor: 0.5,
            wheels,
            ..Default::default()
        };
        let bytes = encode(&message).expect("encodes");
        let (back, used) =
            cdr_encoding::from_bytes::<VehicleState, LittleEndian>(&bytes[4..]).expect("decodes");
        assert_eq!((back, used), (message, bytes.len() - 4));
    }

    #[test]
    fn time_is_split_into_seconds_and_the_rest() {
        assert_eq!(
            Time::from_ns(61_999_999_999),
            Time {
                sec: 61,
                nanosec: 999_999_999
            }
        );
        assert_eq!(Time::from_ns(u64::MAX).sec, i32::MAX);
    }
}
