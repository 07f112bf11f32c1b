// Generated from crates/dashboard/src/wire.rs: `TEAMPULSE_WRITE=1 cargo test -p teampulse-dashboard wire`.

/**
 * A message from the server.
 */
export type FromServer = { "type": "hello" } & Hello | { "type": "streams" } & Declared | { "type": "description" } & Description | { "type": "status" } & Status | { "type": "features", 
/**
 * The features, in order of arrival.
 */
features: Array<Feature>, } | { "type": "samples", 
/**
 * The samples, in order of arrival.
 */
samples: Array<Sample>, } | { "type": "events", 
/**
 * The events, in order of arrival.
 */
events: Array<Event>, } | { "type": "ready" } | { "type": "recording" } & Recording | { "type": "next_phase", 
/**
 * The name of the phase; `null` after the last one.
 */
name: string | null, } | { "type": "required", 
/**
 * The requirements, as `teampulse check` would report them now.
 */
unmet: Array<Unmet>, } | { "type": "unshown", 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The reason.
 */
reason: string, } | { "type": "network", 
/**
 * The computers, sorted by name.
 */
computers: Array<Computer>, 
/**
 * The buses; empty for a recording.
 */
buses: Array<Bus>, } | { "type": "machine" } & Machine | { "type": "missed" } & Missed | { "type": "pong" } & Pong | { "type": "echo" } & Echo | { "type": "history" } & HistoryReply | { "type": "refused" } & Refused | { "type": "ended" } & Ended | { "type": "playback" } & Playback | { "type": "moved" } & Playback | { "type": "timeline" } & Timeline;

/**
 * The session, and the permissions of this viewer.
 */
export type Hello = { 
/**
 * The version of this protocol: `PROTOCOL`.
 */
protocol: number, 
/**
 * The name of the session.
 */
session: string, 
/**
 * The version of teampulse.
 */
version: string, 
/**
 * Whether the session is live.
 */
mode: Mode, 
/**
 * The start of the session, since the Unix epoch [ms].
 */
began_unix_ms: number, 
/**
 * The current time [s].
 */
now: number, 
/**
 * How long past data is stored [s].
 */
stored_secs: number, 
/**
 * The viewer that receives this message.
 */
viewer: Viewer, 
/**
 * The markers of the study, with their keys; any other letter sets a marker named after it.
 */
markers: Array<Marker>, 
/**
 * The phases of the study, in order.
 */
phases: Array<PhasePlan>, };

/**
 * Whether a session is live.
 */
export type Mode = "live" | "replay";

/**
 * The permissions of a viewer.
 */
export type Viewer = { 
/**
 * The name of the sender in the bag: `dashboard`, `dashboard:192.168.1.7`.
 */
name: string, 
/**
 * The general permission of the viewer.
 */
right: Right, 
/**
 * The verbs of the commands that the viewer may send: `mark`, `next_phase`, `stop`, …
 */
commands: Array<string>, 
/**
 * Whether streams are hidden from this viewer.
 */
blind: boolean, };

/**
 * The general permission of a viewer: each includes the previous ones.
 */
export type Right = "watch" | "mark" | "control";

/**
 * A marker of the study.
 */
export type Marker = { 
/**
 * The key that sets the marker; empty if it has only a button.
 */
key: string, 
/**
 * The label of the marker.
 */
label: string, };

/**
 * A phase of the study.
 */
export type PhasePlan = { 
/**
 * The name of the phase.
 */
name: string, 
/**
 * The start of the phase [s]; `null` if it is started manually.
 */
from: number | null, 
/**
 * The duration of the phase [s]; `null` if it lasts until the next phase.
 */
lasts: number | null, };

/**
 * New streams, and streams whose declaration changed.
 */
export type Declared = { 
/**
 * The subjects and devices of the streams, without duplicates.
 */
whose: Array<Whose>, 
/**
 * The channel lists of the streams, without duplicates.
 */
channels: Array<ChannelList>, 
/**
 * The streams.
 */
streams: Array<StreamRow>, };

/**
 * A subject and the device that measures it.
 */
export type Whose = { 
/**
 * The kind of subject: `person`, `robot`, `team` or `session`.
 */
about: string, 
/**
 * The id of that person or robot; empty for the team and the session.
 */
subject: string, 
/**
 * The device; may be empty.
 */
device: string, };

/**
 * The channels of each sample, in order.
 */
export type ChannelList = { 
/**
 * The names of the channels.
 */
names: Array<string>, 
/**
 * The units of the channels.
 */
units: Array<string>, };

/**
 * A stream without its descriptive text, which `describe` requests. Omitted fields are empty, false or 0.
 */
export type StreamRow = { 
/**
 * The number of the stream in this session.
 */
id: number, 
/**
 * The ROS topic of the stream.
 */
name: string, 
/**
 * What the stream measures.
 */
signal: string, 
/**
 * The shape of the data.
 */
shape: string, 
/**
 * The index of the subject and device in `whose`.
 */
whose: number, 
/**
 * The index of the channel list in `channels`.
 */
channels: number, 
/**
 * The type of the messages.
 */
message_type?: string, 
/**
 * Whether the stream was computed here.
 */
derived?: boolean, 
/**
 * The declared rate [Hz].
 */
rate_hz?: number, 
/**
 * The family of the feature.
 */
family?: string, 
/**
 * The time span that each value covers.
 */
window?: Span, 
/**
 * The numbers of the streams from which this one was computed.
 */
inputs?: Array<number>, 
/**
 * The topic, if this stream holds the samples of a second publisher on it.
 */
beside?: string, 
/**
 * Whether this viewer receives no data of the stream.
 */
hidden?: boolean, 
/**
 * Whether the data goes to workers only and is never shown.
 */
private?: boolean, };

/**
 * The descriptive text of a stream: the answer to `describe`.
 */
export type Description = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The recipe by which the stream was computed; empty for a raw stream.
 */
method: string, 
/**
 * A sentence that describes the stream to people.
 */
doc: string, };

/**
 * A stream of the session, as programs receive it, and as a page knows it once it is [declared](super::Declared) and
 * described.
 */
export type Stream = { 
/**
 * The number of the stream in this session, by which all other messages refer to it.
 */
id: number, 
/**
 * The ROS topic of the stream.
 */
name: string, 
/**
 * What the stream measures: `ecg`, `eda`, `battery`, `event`, … (a closed list).
 */
signal: string, 
/**
 * The kind of subject: `person`, `robot`, `team` or `session`.
 */
about: string, 
/**
 * The id of that person or robot; empty for the team and the session.
 */
subject: string, 
/**
 * The measuring device; may be empty.
 */
device: string, 
/**
 * Whether the stream was computed here; otherwise it is raw.
 */
derived: boolean, 
/**
 * The shape of the data: `sample`, `wave`, `feature`, `event`, or `message` for a ROS message from elsewhere.
 */
shape: string, 
/**
 * The type of the messages, such as `nav_msgs/msg/Odometry`; empty for our own shapes.
 */
message_type: string, 
/**
 * The values of each sample, in order.
 */
channels: Array<Channel>, 
/**
 * The declared rate [Hz]; 0 if none is declared or the rate is irregular.
 */
rate_hz: number, 
/**
 * How the stream was computed, as a recipe; empty for a raw stream.
 */
method: string, 
/**
 * The family of the feature: `heart`, `skin`; empty for a raw stream.
 */
family: string, 
/**
 * The time span that each value covers; `null` if the values are instantaneous.
 */
window: Span | null, 
/**
 * The topics of the streams from which this one was computed.
 */
inputs: Array<string>, 
/**
 * The topic, if this stream holds the samples of a second publisher on it; empty for any other stream.
 */
beside: string, 
/**
 * A sentence that describes the stream to people.
 */
doc: string, 
/**
 * Whether this viewer receives no data of the stream because it would unblind them; see `show_estimates`.
 */
hidden: boolean, 
/**
 * Whether the data goes to workers only and is never shown, such as pictures of a camera in which faces must first
 * be hidden.
 */
private: boolean, };

/**
 * A channel of a stream: one value of each sample.
 */
export type Channel = { 
/**
 * The name of the channel; for a ROS message, the path of the field.
 */
name: string, 
/**
 * The unit of the channel in ASCII: `uS`, `degC`, `1/min`, `1` for a fraction.
 */
unit: string, };

/**
 * The time span that each value of a feature covers.
 */
export type Span = { "secs": number } | "phases";

/**
 * The health of raw streams.
 */
export type Status = { 
/**
 * The time of the assessment [s].
 */
t: number, 
/**
 * The health of each raw stream.
 */
streams: Array<StreamHealth>, };

/**
 * The health of a stream.
 */
export type StreamHealth = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The state: `never`, `ok`, `degraded`, `stale` or `dead`.
 */
state: string, 
/**
 * Why the stream is not ok; empty if it is.
 */
reason: string, 
/**
 * The rate over the last seconds [Hz].
 */
rate_hz: number, 
/**
 * The time since the last sample of the stream arrived [s].
 */
age_secs: number | null, 
/**
 * The number of samples received, including duplicates.
 */
received: number, 
/**
 * The number of samples lost before they arrived; `null` if it cannot be known.
 */
lost_source: number | null, 
/**
 * The number of samples lost in the internal queue.
 */
lost_queue: number, 
/**
 * The number of samples out of order.
 */
late: number, 
/**
 * The number of duplicates.
 */
duplicates: number, 
/**
 * How the stream's clock is modelled: `host`, `one_way`, `two_way`, `sample_index` or `remote`.
 */
clock: string, 
/**
 * The number of times that the stream's clock was restarted.
 */
epoch: number, 
/**
 * The offset of the stream's clock, positive if it is ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * The rate error of the stream's clock, positive if it is fast [ppm].
 */
skew_ppm: number | null, 
/**
 * The standard deviation of the delays of the samples [s].
 */
jitter_secs: number | null, 
/**
 * Half the width of the 95 % interval of a sample's true time [s].
 */
uncertainty_secs: number | null, 
/**
 * The median time from measurement to arrival [s].
 */
latency_secs: number | null, };

/**
 * The values of a feature over one window.
 */
export type Feature = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The end of the window [s].
 */
t: number, 
/**
 * The length of the window [s].
 */
window_secs: number, 
/**
 * The share of the window with data [0..1].
 */
coverage: number | null, 
/**
 * The quality of the data [0..1].
 */
quality: number | null, 
/**
 * The value of each channel; `null` unless its reason is `ok`.
 */
values: Array<number | null>, 
/**
 * The standard uncertainty of each value; empty if none can be stated.
 */
sigmas: Array<number | null>, 
/**
 * For each channel `ok`, or the reason why it has no value: `short`, `gap`, `quality`, `missing`, `undefined`,
 * `no_baseline`, `nothing`, `brief_baseline`.
 */
reasons: Array<string>, };

/**
 * A reading: one sample of a stream.
 */
export type Sample = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The time of the measurement [s].
 */
t: number, 
/**
 * The value of each channel of the stream.
 */
values: Array<number | null>, };

/**
 * An event.
 */
export type Event = { 
/**
 * The number of the event, in order of arrival.
 */
number: number, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The time of the event [s].
 */
t: number, 
/**
 * The kind: `phase`, `marker`, `report`, `beat`, `response`, `breath`, `burst`, `blink`, `intervention`,
 * `command`, `fault` or `clock`.
 */
kind: string, 
/**
 * The label of the event, as in the bag.
 */
label: string, 
/**
 * The value of the event.
 */
value: number | null, 
/**
 * The duration of the event [s]; `null` if unknown.
 */
duration: number | null, 
/**
 * The command, note or acknowledgement that the event records.
 */
request: Request | null, 
/**
 * The content of an alert, on `/team/alerts` or on a person's own alert stream.
 */
alert: Alert | null, };

/**
 * A request or a text entered by a user.
 */
export type Request = { 
/**
 * The sender: `keys`, `dashboard`, `ros:/panel`.
 */
who: string, 
/**
 * The verb of a command, or `note`, `acknowledge`, `show_estimates`.
 */
verb: string, 
/**
 * The rest of the request: a marker's label, the note, or the label of the acknowledged event.
 */
text: string, };

/**
 * The content of an alert event.
 */
export type Alert = { 
/**
 * The robot or the person; `team` or `session` if the alert is about no individual.
 */
who: string, 
/**
 * The cause: `offline`, `wifi is stuck`, `HR of strap/ecg/heart above 120 1/min`.
 */
why: string, 
/**
 * The stage: `raised`, `answered`, `unknown` or `over`.
 */
stage: string, 
/**
 * The urgency: `act`, `soon` or `note`; the default for the cause unless the label states the study's.
 */
tier: string, 
/**
 * Whether the urgency is the study's, which the label states while an alert of `[[alerts]]` is raised.
 */
is_of_study: boolean, };

/**
 * The state of the recording.
 */
export type Recording = { 
/**
 * The stage of the recording.
 */
stage: RecordingStage, 
/**
 * The folder of the bag, or of the newest bag if there are several; empty if there is none.
 */
path: string, 
/**
 * The number of bytes synced to the disk, in all bags of the session.
 */
bytes: number, 
/**
 * The growth rate over the last ten seconds [bytes/s].
 */
bytes_per_sec: number, 
/**
 * The free space on the disk [bytes].
 */
free_bytes: number | null, 
/**
 * The time since the recording last grew [s].
 */
sync_age_secs: number | null, 
/**
 * How long the newest bag has been recorded; without a bag, how long the session has run [s].
 */
elapsed_secs: number, 
/**
 * How much is kept in memory while the recording is paused [s].
 */
kept_secs: number | null, 
/**
 * Why the recording ended early; empty otherwise.
 */
reason: string, };

/**
 * The stage of a recording.
 */
export type RecordingStage = "nothing" | "tables" | "not_begun" | "open" | "paused" | "finished" | "ended_early";

/**
 * This program and its machine.
 */
export type Machine = { 
/**
 * The processor time of this program per unit of time [cores].
 */
cpu_cores: number, 
/**
 * The memory used by this program [bytes].
 */
memory_bytes: number | null, 
/**
 * The number of records that the dashboard itself skipped since the session began.
 */
skipped: number, 
/**
 * The number of connected viewers.
 */
viewers: number, 
/**
 * The amount of data queued for this client [bytes].
 */
waiting_bytes: number, };

/**
 * Another computer, and its clock.
 */
export type Computer = { 
/**
 * The host and process of the computer if they are announced, otherwise its node; unique for each participant.
 */
name: string, 
/**
 * How the clock is known: by round-trip `probes`, by the `stamps` of received messages, or `unknown` so far.
 */
known_by: string, 
/**
 * The offset of the clock, positive if it is ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * The rate error of the clock, positive if it is fast [ppm].
 */
skew_ppm: number | null, 
/**
 * Half the width of the 95 % interval of the true time of a stamp [s].
 */
uncertainty_secs: number | null, 
/**
 * The shortest round trip of the last minute's probes [s].
 */
round_trip_secs: number | null, 
/**
 * The time since the clock last answered a probe [s].
 */
probe_age_secs: number | null, 
/**
 * The number of streams that the computer stamps.
 */
streams: number, };

/**
 * A bus that carries streams.
 */
export type Bus = { 
/**
 * The name of the bus: `ROS domain 0`.
 */
name: string, 
/**
 * The name of our node on the bus.
 */
node: string, 
/**
 * The number of other discovered participants: usually processes.
 */
participants: number, 
/**
 * The number of topics that these participants publish.
 */
topics: number, 
/**
 * The number of the session's streams on the bus.
 */
streams: number, 
/**
 * The rate of data received on the bus: messages, and samples of waves [1/s].
 */
rate_hz: number, 
/**
 * The number of samples lost before arrival, over the streams whose losses can be counted; `null` if there is no
 * such stream.
 */
lost: number | null, 
/**
 * The number of streams on the bus that have no sequence numbers, so that their losses cannot be counted.
 */
uncounted: number, };

/**
 * The messages that a client missed because it was too slow, since it connected.
 */
export type Missed = { 
/**
 * The number of events; never markers, alerts, phases or faults.
 */
events: number, 
/**
 * The number of statuses and feature values that were replaced by newer ones.
 */
states: number, 
/**
 * The number of readings and waves.
 */
signals: number, 
/**
 * The number of pictures that were replaced by newer ones.
 */
pictures: number, };

/**
 * An unmet requirement of the study.
 */
export type Unmet = { 
/**
 * The name of the requirement in `teampulse check`: `battery of robot robot1`.
 */
what: string, 
/**
 * The remedy.
 */
fix: string, };

/**
 * The answer to a probe of the clock.
 */
export type Pong = { 
/**
 * The value sent in `ping`.
 */
sent: number, 
/**
 * When the probe arrived, by the session's clock [s].
 */
received: number, 
/**
 * When the reply was sent [s].
 */
replied: number, };

/**
 * An action of this client, as read back from the session's records.
 */
export type Echo = { 
/**
 * The reference sent by the client.
 */
reference: string, 
/**
 * The event's label.
 */
label: string, 
/**
 * The time of the event in the recording [s].
 */
t: number, 
/**
 * The time of the event minus the requested time [s]; `null` if none was requested.
 */
off_secs: number | null, 
/**
 * Whether the recording has been synced to the disk since the event; `null` if nothing is recorded.
 */
on_disk: boolean | null, };

/**
 * The stored data of a stream, in columns of equal width.
 */
export type HistoryReply = { 
/**
 * The reference sent by the client.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The start of the first column [s].
 */
from: number, 
/**
 * The width of a column [s].
 */
step: number, 
/**
 * The columns of each channel.
 */
channels: Array<Column>, };

/**
 * The values of a channel in each column; `null` for a column without data.
 */
export type Column = { 
/**
 * The minimum of each column.
 */
min: Array<number | null>, 
/**
 * The maximum of each column.
 */
max: Array<number | null>, 
/**
 * The mean of each column.
 */
mean: Array<number | null>, };

/**
 * Why a request was not carried out.
 */
export type Refused = { 
/**
 * The reference sent by the client; `null` if there is none or it could not be read.
 */
reference: string | null, 
/**
 * The reason.
 */
reason: string, 
/**
 * What the user can do; may be empty.
 */
hint: string, };

/**
 * The end of the session.
 */
export type Ended = { 
/**
 * The reason.
 */
reason: string, };

/**
 * The position in a recording, and the state of the playback.
 */
export type Playback = { 
/**
 * The time shown [s].
 */
t: number, 
/**
 * The playback speed relative to real time.
 */
rate: number, 
/**
 * Whether playback is paused.
 */
paused: boolean, 
/**
 * The length of the recording [s].
 */
length: number, };

/**
 * The events of the whole recording.
 */
export type Timeline = { 
/**
 * The events of the session, the team and the robots, without physiological events.
 */
events: Array<Event>, 
/**
 * The number of events that did not fit.
 */
left_out: number, 
/**
 * The times without data from people and robots.
 */
absences: Array<Absence>, };

/**
 * The times without data from a person or a robot.
 */
export type Absence = { 
/**
 * The id of the person or robot.
 */
subject: string, 
/**
 * The kind of subject: `person` or `robot`.
 */
about: string, 
/**
 * The gaps, in order of time.
 */
gaps: Array<Gap>, };

/**
 * A span without samples.
 */
export type Gap = { 
/**
 * The start of the gap [s].
 */
from: number, 
/**
 * The end of the gap [s].
 */
to: number, };

/**
 * A message from a browser. Any other message is refused.
 */
export type FromBrowser = { "type": "ping", 
/**
 * Any number, such as the browser's own time [ms]; it is returned unchanged.
 */
sent: number, } | { "type": "want", 
/**
 * The streams; at most 256.
 */
streams: Array<Wanted>, } | { "type": "shown", 
/**
 * The streams, each listed once per picture.
 */
streams: Array<number>, } | { "type": "history" } & History | { "type": "describe", 
/**
 * The client's reference, returned in `refused`.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, } | { "type": "command", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, 
/**
 * The command.
 */
text: string, 
/**
 * When the key or the button was pressed, by the probed session clock [s]; `null` for now.
 */
at: number | null, } | { "type": "note", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, 
/**
 * The note.
 */
text: string, 
/**
 * The time that it refers to: when typing began, or the selected moment [s]; `null` for now.
 */
at: number | null, } | { "type": "annotate", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, 
/**
 * The label.
 */
text: string, 
/**
 * The start of the span: at most ten minutes ago [s].
 */
from: number, 
/**
 * The end of the span [s].
 */
to: number, } | { "type": "acknowledge", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, 
/**
 * The event's label, as received.
 */
alert: string, 
/**
 * The time of the acknowledgement [s]; `null` for now.
 */
at: number | null, } | { "type": "report", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, 
/**
 * The person; `null` if there is only one.
 */
subject: string | null, 
/**
 * The scale, as a single word: `isa`.
 */
scale: string, 
/**
 * The answer: 1 to 5 for ISA.
 */
value: number, 
/**
 * The time of the report [s]; `null` for now.
 */
at: number | null, } | { "type": "show_estimates", 
/**
 * The client's reference, returned in `echo` or `refused`.
 */
reference: string, } | { "type": "play", 
/**
 * The client's reference, returned in `refused`.
 */
reference: string, 
/**
 * The time to seek to [s].
 */
t: number | null, 
/**
 * The playback speed relative to real time: 0.1 to 20.
 */
rate: number | null, 
/**
 * Whether playback is paused.
 */
paused: boolean | null, };

/**
 * A stream that a browser draws.
 */
export type Wanted = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The maximum number of points, or pictures, drawn per second; a faster wave is sent as pairs of its minimum and
 * maximum, in the order in which they occur. 0 for all samples.
 */
points_per_sec: number, 
/**
 * For a camera: whether landmarks are drawn on its pictures. If so, pictures are sent as soon as their landmarks
 * have arrived; without any landmarks, all pictures are sent.
 */
with_points: boolean, };

/**
 * A request for the stored data of a stream.
 */
export type History = { 
/**
 * The client's reference, returned in the reply.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * The start [s].
 */
from: number, 
/**
 * The end [s].
 */
to: number, 
/**
 * The maximum number of columns, such as one per pixel; no more than 4000.
 */
points: number, };

export const PROTOCOL = 6;
export const MOST_WANTED = 256;
/** The length of the header before the samples of a binary frame [bytes]. */
export const WAVE_HEAD_BYTES = 24;
/** The length of the header before the file of a picture [bytes]. */
export const PICTURE_HEAD_BYTES = 16;
