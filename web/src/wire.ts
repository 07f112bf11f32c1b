// Generated from crates/dashboard/src/wire.rs: `TEAMPULSE_WRITE=1 cargo test -p teampulse-dashboard wire`.

/**
 * A message of the server.
 */
export type FromServer = { "type": "hello" } & Hello | { "type": "streams" } & Declared | { "type": "description" } & Description | { "type": "status" } & Status | { "type": "features", 
/**
 * In the order in which they came.
 */
features: Array<Feature>, } | { "type": "samples", 
/**
 * In the order in which they came.
 */
samples: Array<Sample>, } | { "type": "events", 
/**
 * In the order in which they came.
 */
events: Array<Event>, } | { "type": "ready" } | { "type": "recording" } & Recording | { "type": "next_phase", 
/**
 * Its name; `null` after the last one.
 */
name: string | null, } | { "type": "required", 
/**
 * As `teampulse check` would find it now.
 */
unmet: Array<Unmet>, } | { "type": "unshown", 
/**
 * The stream's number.
 */
stream: number, 
/**
 * Why.
 */
reason: string, } | { "type": "network", 
/**
 * In the order of their names.
 */
computers: Array<Computer>, 
/**
 * Of a recording none.
 */
buses: Array<Bus>, } | { "type": "machine" } & Machine | { "type": "missed" } & Missed | { "type": "pong" } & Pong | { "type": "echo" } & Echo | { "type": "history" } & HistoryReply | { "type": "refused" } & Refused | { "type": "ended" } & Ended | { "type": "playback" } & Playback | { "type": "moved" } & Playback | { "type": "timeline" } & Timeline;

/**
 * The session, and what this viewer may do there.
 */
export type Hello = { 
/**
 * The version of this contract: `PROTOCOL`.
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
 * Whether it happens now.
 */
mode: Mode, 
/**
 * When it began, since the Unix epoch [ms].
 */
began_unix_ms: number, 
/**
 * The present time [s].
 */
now: number, 
/**
 * For how long the past is stored [s].
 */
stored_secs: number, 
/**
 * This viewer.
 */
viewer: Viewer, 
/**
 * The markers of the study, with their keys; any other letter sets a marker of its own name.
 */
markers: Array<Marker>, 
/**
 * The phases of the study, in their order.
 */
phases: Array<PhasePlan>, };

/**
 * Whether the session happens now.
 */
export type Mode = "live" | "replay";

/**
 * What a viewer may do.
 */
export type Viewer = { 
/**
 * The name of the sender in the bag: `dashboard`, `dashboard:192.168.1.7`.
 */
name: string, 
/**
 * What the viewer may do at all.
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
 * What a viewer may do at all: each includes those before it.
 */
export type Right = "watch" | "mark" | "control";

/**
 * A marker of the study.
 */
export type Marker = { 
/**
 * Its key; empty for a button only.
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
 * When it begins [s]; `null` where it begins by hand.
 */
from: number | null, 
/**
 * How long it lasts [s]; `null` until the next one.
 */
lasts: number | null, };

/**
 * Streams that are new, or of which more is known.
 */
export type Declared = { 
/**
 * Whom they are about, and by which devices they are measured.
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
 * Whom streams are about, and by which device they are measured.
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
 * The numbers of each sample, in their order.
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
 * A stream, without what is asked for by `describe`. What is left out is empty, false or 0.
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
 * The place in `whose` of whom it is about.
 */
whose: number, 
/**
 * The place of its channels in `channels`.
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
 * The topic of which this holds a second publisher's samples.
 */
beside?: string, 
/**
 * Whether this viewer gets no data of it.
 */
hidden?: boolean, 
/**
 * Whether nobody is shown its data.
 */
private?: boolean, };

/**
 * What a stream is, in words: the answer to a `describe`.
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
 * A stream of the session, as programs get it, and as a page has it once it is [declared](super::Declared) and described.
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
 * Whom it is about: `person`, `robot`, `team` or `session`.
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
 * The topic of which this holds a second publisher's samples; empty for any other stream.
 */
beside: string, 
/**
 * One sentence for people.
 */
doc: string, 
/**
 * Whether this viewer gets no data of it, as they would no longer be blind; see `show_estimates`.
 */
hidden: boolean, 
/**
 * Whether nobody is shown its data, which goes to workers alone: the pictures of a camera whose faces are hidden first.
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
 * When it was judged [s].
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
 * Why it is not ok; empty when it is.
 */
reason: string, 
/**
 * The rate over the last seconds [Hz].
 */
rate_hz: number, 
/**
 * Since its last sample arrived [s].
 */
age_secs: number | null, 
/**
 * The samples taken, duplicates included.
 */
received: number, 
/**
 * The samples lost on the way here; `null` where that can't be known.
 */
lost_source: number | null, 
/**
 * The samples lost in our own queue.
 */
lost_queue: number, 
/**
 * The samples out of order.
 */
late: number, 
/**
 * The duplicates.
 */
duplicates: number, 
/**
 * How its clock is modelled: `host`, `one_way`, `two_way`, `sample_index` or `remote`.
 */
clock: string, 
/**
 * How often its clock was restarted.
 */
epoch: number, 
/**
 * How far its clock is ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * How much faster its clock runs [ppm].
 */
skew_ppm: number | null, 
/**
 * The standard deviation of its delays [s].
 */
jitter_secs: number | null, 
/**
 * Half the interval that holds the true time with a probability of 95 % [s].
 */
uncertainty_secs: number | null, 
/**
 * The median time from measuring to arrival [s].
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
 * For each channel `ok` or why it has no value: `short`, `gap`, `quality`, `missing`, `undefined`, `no_baseline`,
 * `nothing`, `brief_baseline`.
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
 * Its number, in the order in which events came.
 */
number: number, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * When it happened [s].
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
 * How long it lasts [s]; `null` where that is not known.
 */
duration: number | null, 
/**
 * What somebody asked for or wrote, of a command, a note or an acknowledgement.
 */
request: Request | null, 
/**
 * What it says of an alert, on `/team/alerts` or a person's own stream of alerts.
 */
alert: Alert | null, };

/**
 * What somebody asked for or wrote.
 */
export type Request = { 
/**
 * Who: `keys`, `dashboard`, `ros:/panel`.
 */
who: string, 
/**
 * The verb of a command, or `note`, `acknowledge`, `show_estimates`.
 */
verb: string, 
/**
 * The rest: a marker's label, the note, the label of what was acknowledged.
 */
text: string, };

/**
 * What an event says of an alert.
 */
export type Alert = { 
/**
 * The robot or the person; `team` or `session` for what is about nobody alone.
 */
who: string, 
/**
 * Why: `offline`, `wifi is stuck`, `HR of strap/ecg/heart above 120 1/min`.
 */
why: string, 
/**
 * `raised`, `answered`, `unknown` or `over`.
 */
stage: string, 
/**
 * How urgent it is: `act`, `soon` or `note`; as the study states it only when it is raised.
 */
tier: string, 
/**
 * Whether the study states how urgent it is: one of its `[[alerts]]` is raised.
 */
is_of_study: boolean, };

/**
 * The recording.
 */
export type Recording = { 
/**
 * Where it stands.
 */
stage: RecordingStage, 
/**
 * The folder of the bag, of several the newest; empty where there is none.
 */
path: string, 
/**
 * The bytes that are synced to the disk, in all bags of the session.
 */
bytes: number, 
/**
 * How fast it grew over the last ten seconds [bytes/s].
 */
bytes_per_sec: number, 
/**
 * The free space on the disk [bytes].
 */
free_bytes: number | null, 
/**
 * Since it last grew [s].
 */
sync_age_secs: number | null, 
/**
 * How long this bag has been recorded; while there is none, how long the session has run [s].
 */
elapsed_secs: number, 
/**
 * How many seconds are kept in memory while the recording is paused [s].
 */
kept_secs: number | null, 
/**
 * Why it ended early; empty otherwise.
 */
reason: string, };

/**
 * Where a recording stands.
 */
export type RecordingStage = "nothing" | "tables" | "not_begun" | "open" | "paused" | "finished" | "ended_early";

/**
 * This program and its machine.
 */
export type Machine = { 
/**
 * The processor time of this program per time [cores].
 */
cpu_cores: number, 
/**
 * Its memory [bytes].
 */
memory_bytes: number | null, 
/**
 * The records that the dashboard itself skipped since the session began.
 */
skipped: number, 
/**
 * The viewers that are connected.
 */
viewers: number, 
/**
 * What waits for this client [bytes].
 */
waiting_bytes: number, };

/**
 * Another computer, and its clock.
 */
export type Computer = { 
/**
 * Its host and process where they are announced, otherwise its node; different for each participant.
 */
name: string, 
/**
 * How its clock is known: `probes` there and back, `stamps` of what arrives, or not yet: `unknown`.
 */
known_by: string, 
/**
 * How far its clock is ahead of the session's [s].
 */
offset_secs: number | null, 
/**
 * How much faster it runs [ppm].
 */
skew_ppm: number | null, 
/**
 * Half the interval that holds the true time of what it stamps with a probability of 95 % [s].
 */
uncertainty_secs: number | null, 
/**
 * The shortest way there and back of the last minute's probes [s].
 */
round_trip_secs: number | null, 
/**
 * Since its clock last answered a probe [s].
 */
probe_age_secs: number | null, 
/**
 * How many streams it stamps.
 */
streams: number, };

/**
 * A bus on which streams come.
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
 * The others that were discovered: processes, as a rule.
 */
participants: number, 
/**
 * Their topics.
 */
topics: number, 
/**
 * How many of the session's streams come on it.
 */
streams: number, 
/**
 * What comes on it: messages, and samples of waves [1/s].
 */
rate_hz: number, 
/**
 * What was lost on the way here, of the streams whose losses can be counted; `null` where there is none.
 */
lost: number | null, 
/**
 * How many of its streams number nothing, so that losses can't be counted.
 */
uncounted: number, };

/**
 * What a client did not get as it was too slow, since it connected.
 */
export type Missed = { 
/**
 * Events; never markers, alerts, phases or faults.
 */
events: number, 
/**
 * Statuses and values of features that a newer one replaced.
 */
states: number, 
/**
 * Readings and waves.
 */
signals: number, 
/**
 * Pictures that a newer one replaced.
 */
pictures: number, };

/**
 * What the study requires and is not there.
 */
export type Unmet = { 
/**
 * What, as `teampulse check` names it: `battery of robot robot1`.
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
 * As it was in `ping`.
 */
sent: number, 
/**
 * When the probe arrived, by the session's clock [s].
 */
received: number, 
/**
 * When the answer left [s].
 */
replied: number, };

/**
 * What this client did, as it was read back.
 */
export type Echo = { 
/**
 * As it was sent.
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
 * That time less the one that was sent [s]; `null` where none was sent.
 */
off_secs: number | null, 
/**
 * Whether the recording was synced to the disk since; `null` where nothing is recorded.
 */
on_disk: boolean | null, };

/**
 * What is stored of a stream, in columns of one width.
 */
export type HistoryReply = { 
/**
 * As it was sent.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * When the first column begins [s].
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
 * The columns of a channel; `null` where there were no data.
 */
export type Column = { 
/**
 * The smallest number of each column.
 */
min: Array<number | null>, 
/**
 * The largest.
 */
max: Array<number | null>, 
/**
 * The mean.
 */
mean: Array<number | null>, };

/**
 * Why something was not done.
 */
export type Refused = { 
/**
 * As it was sent; `null` for what could not be read.
 */
reference: string | null, 
/**
 * Why.
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
 * Why.
 */
reason: string, };

/**
 * The position in a recording, and how it moves on.
 */
export type Playback = { 
/**
 * The time that is shown [s].
 */
t: number, 
/**
 * How many times as fast as it was recorded.
 */
rate: number, 
/**
 * Whether it stands still.
 */
paused: boolean, 
/**
 * The length of the recording [s].
 */
length: number, };

/**
 * What happened in the whole recording.
 */
export type Timeline = { 
/**
 * The events of the session, the team and the robots, without those of bodies.
 */
events: Array<Event>, 
/**
 * How many events did not fit.
 */
left_out: number, 
/**
 * When nothing came from people and robots.
 */
absences: Array<Absence>, };

/**
 * When nothing came from a person or a robot.
 */
export type Absence = { 
/**
 * The id.
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
 * Its begin [s].
 */
from: number, 
/**
 * Its end [s].
 */
to: number, };

/**
 * A message of a browser. Any other is refused.
 */
export type FromBrowser = { "type": "ping", 
/**
 * Any number, returned as it is: the browser's own time [ms].
 */
sent: number, } | { "type": "want", 
/**
 * At most 256.
 */
streams: Array<Wanted>, } | { "type": "shown", 
/**
 * Each once for each picture.
 */
streams: Array<number>, } | { "type": "history" } & History | { "type": "describe", 
/**
 * Comes back in `refused`.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, } | { "type": "command", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, 
/**
 * The command.
 */
text: string, 
/**
 * When the key or the button was pressed, by the probed clock [s]; `null` for now.
 */
at: number | null, } | { "type": "note", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, 
/**
 * The note.
 */
text: string, 
/**
 * What it is about: when its writing began, or the moment that was chosen [s]; `null` for now.
 */
at: number | null, } | { "type": "annotate", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, 
/**
 * The label.
 */
text: string, 
/**
 * The begin of the span: at most ten minutes ago [s].
 */
from: number, 
/**
 * Its end [s].
 */
to: number, } | { "type": "acknowledge", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, 
/**
 * The event's label, as it came.
 */
alert: string, 
/**
 * When [s]; `null` for now.
 */
at: number | null, } | { "type": "report", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, 
/**
 * The person; `null` where there is only one.
 */
subject: string | null, 
/**
 * The scale, one word: `isa`.
 */
scale: string, 
/**
 * The answer: 1 to 5 for ISA.
 */
value: number, 
/**
 * When [s]; `null` for now.
 */
at: number | null, } | { "type": "show_estimates", 
/**
 * Comes back in `echo` or `refused`.
 */
reference: string, } | { "type": "play", 
/**
 * Comes back in `refused`.
 */
reference: string, 
/**
 * Another time [s].
 */
t: number | null, 
/**
 * How many times as fast as it was recorded: 0.1 to 20.
 */
rate: number | null, 
/**
 * Whether it stands still.
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
 * How many points, or pictures, a second are drawn at most; a faster wave comes as pairs of its smallest and largest
 * samples, in their order. 0 for all of them.
 */
points_per_sec: number, 
/**
 * Of a camera: whether the points found in its pictures are drawn on them. Then those pictures come that points were
 * found in, as soon as these have come; all of them while there are none.
 */
with_points: boolean, };

/**
 * What is asked for of what is stored of a stream.
 */
export type History = { 
/**
 * Comes back in the reply.
 */
reference: string, 
/**
 * The stream's number.
 */
stream: number, 
/**
 * From when [s].
 */
from: number, 
/**
 * Until when [s].
 */
to: number, 
/**
 * In how many columns at most: as many as pixels. At most 4000.
 */
points: number, };

export const PROTOCOL = 6;
export const MOST_WANTED = 256;
/** The length of what precedes the samples of a binary frame [bytes]. */
export const WAVE_HEAD_BYTES = 24;
/** The length of what precedes the file of a picture [bytes]. */
export const PICTURE_HEAD_BYTES = 16;
