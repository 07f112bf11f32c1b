// Generated from crates/dashboard/src/wire.rs: `TEAMPULSE_WRITE=1 cargo test -p teampulse-dashboard wire`.

/**
 * A message from the server.
 */
export type FromServer = { "type": "hello" } & Hello | { "type": "streams" } & Declared | { "type": "description" } & Description | { "type": "status" } & Status | { "type": "features", 
/**
 * In order of arrival.
 */
features: Array<Feature>, } | { "type": "samples", 
/**
 * In order of arrival.
 */
samples: Array<Sample>, } | { "type": "events", 
/**
 * In order of arrival.
 */
events: Array<Event>, } | { "type": "ready" } | { "type": "recording" } & Recording | { "type": "next_phase", 
/**
 * Its name; `null` after the last one.
 */
name: string | null, } | { "type": "required", 
/**
 * As `teampulse check` would report them now.
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
 * Sorted by name.
 */
computers: Array<Computer>, 
/**
 * Empty for a recording.
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
 * Its start, since the Unix epoch [ms].
 */
began_unix_ms: number, 
/**
 * The present time [s].
 */
now: number, 
/**
 * How long past data are stored [s].
 */
stored_secs: number, 
/**
 * This viewer.
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
 * Its key; empty if it has only a button.
 */
key: string, 
/**
 * Its label.
 */
label: string, };

/**
 * A phase of the study.
 */
export type PhasePlan = { 
/**
 * Its name.
 */
name: string, 
/**
 * Its start [s]; `null` if it is started manually.
 */
from: number | null, 
/**
 * Its duration [s]; `null` if it lasts until the next phase.
 */
lasts: number | null, };

/**
 * New streams, and streams whose declaration changed.
 */
export type Declared = { 
/**
 * Their subjects and devices.
 */
whose: Array<Whose>, 
/**
 * The channels that they have.
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
 * `person`, `robot`, `team` or `session`.
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
 * Their names.
 */
names: Array<string>, 
/**
 * Their units.
 */
units: Array<string>, };

/**
 * A stream without its descriptive text, which `describe` requests. Omitted fields are empty, false or 0.
 */
export type StreamRow = { 
/**
 * Its number in this session.
 */
id: number, 
/**
 * Its ROS topic.
 */
name: string, 
/**
 * What it measures.
 */
signal: string, 
/**
 * The shape of its data.
 */
shape: string, 
/**
 * The index of its subject and device in `whose`.
 */
whose: number, 
/**
 * The index of its channels in `channels`.
 */
channels: number, 
/**
 * The type of its messages.
 */
message_type?: string, 
/**
 * Whether it was computed here.
 */
derived?: boolean, 
/**
 * The declared rate [Hz].
 */
rate_hz?: number, 
/**
 * The family of its feature.
 */
family?: string, 
/**
 * The span of its values.
 */
window?: Span, 
/**
 * The numbers of the streams it was computed from.
 */
inputs?: Array<number>, 
/**
 * The topic whose second publisher's samples this holds.
 */
beside?: string, 
/**
 * Whether this viewer gets no data of it.
 */
hidden?: boolean, 
/**
 * Whether its data goes to workers only and is never shown.
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
 * How it was computed: the recipe; empty for a raw stream.
 */
method: string, 
/**
 * One sentence for people.
 */
doc: string, };

/**
 * A stream of the session, as programs get it, and as a page has it once it is [declared](super::Declared) and
 * described.
 */
export type Stream = { 
/**
 * Its number in this session, by which all other messages name it.
 */
id: number, 
/**
 * Its ROS topic.
 */
name: string, 
/**
 * What it measures: `ecg`, `eda`, `battery`, `event`, … (a closed list).
 */
signal: string, 
/**
 * What it is about: `person`, `robot`, `team` or `session`.
 */
about: string, 
/**
 * The id of that person or robot; empty for the team and the session.
 */
subject: string, 
/**
 * The device that measures; may be empty.
 */
device: string, 
/**
 * Whether it was computed here; otherwise it is raw.
 */
derived: boolean, 
/**
 * `sample`, `wave`, `feature`, `event`, or `message` for a ROS message from elsewhere.
 */
shape: string, 
/**
 * The type of its messages, `nav_msgs/msg/Odometry`; empty for our own shapes.
 */
message_type: string, 
/**
 * The numbers of each sample, in their order.
 */
channels: Array<Channel>, 
/**
 * The declared rate [Hz]; 0 where none is declared or it is irregular.
 */
rate_hz: number, 
/**
 * How it was computed: the recipe; empty for a raw stream.
 */
method: string, 
/**
 * The family of its feature, `heart`, `skin`; empty for a raw stream.
 */
family: string, 
/**
 * The span of its values; `null` where they are instantaneous.
 */
window: Span | null, 
/**
 * The streams it was computed from, by topic.
 */
inputs: Array<string>, 
/**
 * The topic whose second publisher's samples this holds; empty for any other stream.
 */
beside: string, 
/**
 * One sentence for people.
 */
doc: string, 
/**
 * Whether this viewer gets no data of it because it would unblind them; see `show_estimates`.
 */
hidden: boolean, 
/**
 * Whether its data goes to workers only and is never shown: the pictures of a camera whose faces are hidden first.
 */
private: boolean, };

/**
 * One number of each sample of a stream.
 */
export type Channel = { 
/**
 * Its name; for a ROS message the path of the field.
 */
name: string, 
/**
 * Its unit in ASCII: `uS`, `degC`, `1/min`, `1` for a fraction.
 */
unit: string, };

/**
 * The span of a feature's values.
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
 * One for each raw stream.
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
 * `never`, `ok`, `degraded`, `stale` or `dead`.
 */
state: string, 
/**
 * Why it is not ok; empty if it is.
 */
reason: string, 
/**
 * The rate over the last seconds [Hz].
 */
rate_hz: number, 
/**
 * The time since its last sample arrived [s].
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
 * How its clock is modelled: `host`, `one_way`, `two_way`, `sample_index` or `remote`.
 */
clock: string, 
/**
 * The number of times that its clock was restarted.
 */
epoch: number, 
/**
 * The offset of its clock, positive when ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * The rate error of its clock, positive when fast [ppm].
 */
skew_ppm: number | null, 
/**
 * The standard deviation of its delays [s].
 */
jitter_secs: number | null, 
/**
 * Half the width of the 95 % interval of the true time [s].
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
 * A value for each channel; `null` exactly where there is a reason.
 */
values: Array<number | null>, 
/**
 * The standard uncertainty of each value; empty when none can be stated.
 */
sigmas: Array<number | null>, 
/**
 * For each channel `ok`, or the reason why it has no value: `short`, `gap`, `quality`, `missing`, `undefined`,
 * `no_baseline`, `nothing`, `brief_baseline`.
 */
reasons: Array<string>, };

/**
 * A reading.
 */
export type Sample = { 
/**
 * The stream's number.
 */
stream: number, 
/**
 * When it was measured [s].
 */
t: number, 
/**
 * A number for each channel of the stream.
 */
values: Array<number | null>, };

/**
 * An event.
 */
export type Event = { 
/**
 * Its number, in order of arrival.
 */
number: number, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * Its time [s].
 */
t: number, 
/**
 * `phase`, `marker`, `report`, `beat`, `response`, `breath`, `burst`, `blink`, `intervention`, `command`, `fault`
 * or `clock`.
 */
kind: string, 
/**
 * Its label, as in the bag.
 */
label: string, 
/**
 * Its value.
 */
value: number | null, 
/**
 * Its duration [s]; `null` if unknown.
 */
duration: number | null, 
/**
 * The request or text of a command, a note or an acknowledgement.
 */
request: Request | null, 
/**
 * The content of an alert, on `/team/alerts` or a person's own stream of alerts.
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
 * The rest: a marker's label, the note, the label of the acknowledged event.
 */
text: string, };

/**
 * The content of an alert event.
 */
export type Alert = { 
/**
 * The robot or the person; `team` or `session` if it is about no individual.
 */
who: string, 
/**
 * The cause: `offline`, `wifi is stuck`, `HR of strap/ecg/heart above 120 1/min`.
 */
why: string, 
/**
 * `raised`, `answered`, `unknown` or `over`.
 */
stage: string, 
/**
 * The urgency: `act`, `soon` or `note`; defined by the study only when the alert is raised.
 */
tier: string, 
/**
 * Whether the study defines the urgency: one of its `[[alerts]]` is raised.
 */
is_of_study: boolean, };

/**
 * The recording.
 */
export type Recording = { 
/**
 * Its stage.
 */
stage: RecordingStage, 
/**
 * The folder of the bag, of the newest one if there are several; empty if there is none.
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
 * The time since it last grew [s].
 */
sync_age_secs: number | null, 
/**
 * How long this bag has been recorded; without a bag, how long the session has run [s].
 */
elapsed_secs: number, 
/**
 * How much is kept in memory while the recording is paused [s].
 */
kept_secs: number | null, 
/**
 * Why it ended early; empty otherwise.
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
 * Its memory [bytes].
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
 * Its host and process if they are announced, otherwise its node; unique for each participant.
 */
name: string, 
/**
 * How its clock is known: by round-trip `probes`, by the `stamps` of received messages, or `unknown` so far.
 */
known_by: string, 
/**
 * The offset of its clock, positive when ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * The rate error of its clock, positive when fast [ppm].
 */
skew_ppm: number | null, 
/**
 * Half the width of the 95 % interval of the true time of its stamps [s].
 */
uncertainty_secs: number | null, 
/**
 * The shortest round trip of the last minute's probes [s].
 */
round_trip_secs: number | null, 
/**
 * The time since its clock last answered a probe [s].
 */
probe_age_secs: number | null, 
/**
 * The number of streams that it stamps.
 */
streams: number, };

/**
 * A bus that carries streams.
 */
export type Bus = { 
/**
 * Its name: `ROS domain 0`.
 */
name: string, 
/**
 * Our node there.
 */
node: string, 
/**
 * The number of other discovered participants: usually processes.
 */
participants: number, 
/**
 * The number of their topics.
 */
topics: number, 
/**
 * The number of the session's streams on it.
 */
streams: number, 
/**
 * The rate of data received on it: messages, and samples of waves [1/s].
 */
rate_hz: number, 
/**
 * The number of samples lost before arrival, over the streams whose losses can be counted; `null` if there are
 * none.
 */
lost: number | null, 
/**
 * The number of its streams without sequence numbers, whose losses cannot be counted.
 */
uncounted: number, };

/**
 * The messages that a client missed because it was too slow, since it connected.
 */
export type Missed = { 
/**
 * Events; never markers, alerts, phases or faults.
 */
events: number, 
/**
 * Statuses and feature values that were replaced by newer ones.
 */
states: number, 
/**
 * Readings and waves.
 */
signals: number, 
/**
 * Pictures that were replaced by newer ones.
 */
pictures: number, };

/**
 * An unmet requirement of the study.
 */
export type Unmet = { 
/**
 * Its name in `teampulse check`: `battery of robot robot1`.
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
 * An action of this client, as read back from the records.
 */
export type Echo = { 
/**
 * The value sent by the client.
 */
reference: string, 
/**
 * The event's label.
 */
label: string, 
/**
 * Its time in the recording [s].
 */
t: number, 
/**
 * That time minus the requested one [s]; `null` if none was requested.
 */
off_secs: number | null, 
/**
 * Whether the recording was synced to the disk since; `null` if nothing is recorded.
 */
on_disk: boolean | null, };

/**
 * The stored data of a stream, in columns of equal width.
 */
export type HistoryReply = { 
/**
 * The value sent by the client.
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
 * One for each channel.
 */
channels: Array<Column>, };

/**
 * The columns of a channel; `null` if there were no data.
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
 * The value sent by the client; `null` if it could not be read.
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
 * Whether it is paused.
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
 * The ID.
 */
subject: string, 
/**
 * `person` or `robot`.
 */
about: string, 
/**
 * In order of time.
 */
gaps: Array<Gap>, };

/**
 * A span without samples.
 */
export type Gap = { 
/**
 * Its start [s].
 */
from: number, 
/**
 * Its end [s].
 */
to: number, };

/**
 * A message from a browser. Any other message is refused.
 */
export type FromBrowser = { "type": "ping", 
/**
 * Any number, returned unchanged: the browser's own time [ms].
 */
sent: number, } | { "type": "want", 
/**
 * At most 256.
 */
streams: Array<Wanted>, } | { "type": "shown", 
/**
 * A stream is listed once per picture.
 */
streams: Array<number>, } | { "type": "history" } & History | { "type": "describe", 
/**
 * Returned in `refused`.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, } | { "type": "command", 
/**
 * Returned in `echo` or `refused`.
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
 * Returned in `echo` or `refused`.
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
 * Returned in `echo` or `refused`.
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
 * Its end [s].
 */
to: number, } | { "type": "acknowledge", 
/**
 * Returned in `echo` or `refused`.
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
 * Returned in `echo` or `refused`.
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
 * Returned in `echo` or `refused`.
 */
reference: string, } | { "type": "play", 
/**
 * Returned in `refused`.
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
 * The most points, or pictures, drawn per second; a faster wave is sent as pairs of its minimum and maximum, in
 * their order. 0 for all samples.
 */
points_per_sec: number, 
/**
 * For a camera: whether landmarks are drawn on its pictures. Then the pictures with landmarks are sent, as soon
 * as the landmarks have arrived; all pictures while there are none.
 */
with_points: boolean, };

/**
 * A request for the stored data of a stream.
 */
export type History = { 
/**
 * Returned in the reply.
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
 * The most columns, one per pixel. At most 4000.
 */
points: number, };

export const PROTOCOL = 6;
export const MOST_WANTED = 256;
/** The length of the header before the samples of a binary frame [bytes]. */
export const WAVE_HEAD_BYTES = 24;
/** The length of the header before the file of a picture [bytes]. */
export const PICTURE_HEAD_BYTES = 16;
