// Copyright the authors of tactid. Licensed under MIT or Apache-2.0, at your option.
//
// The C interface of tactid's online identifier: mass, centre of mass and inertia of what a robot holds,
// sample by sample in its control loop.
//
// - Units are SI. Vectors and matrices are rows of doubles; quaternions are x, y, z, w.
// - A struct begins with its `size`, which the caller sets to `sizeof`. Members that later versions add stand
//   at its end, and zero in any member means its default: `tactid_options options = {.size = sizeof options};`.
// - A call returns a status; negative ones are errors, and no estimate has changed then. Nothing throws, and nothing
//   aborts but an allocation that fails.
// - All memory but identifiers and snapshots is the caller's. Pointers are read during a call alone.
// - Calls with different identifiers are independent. One identifier, and one snapshot, is used by one thread at a time;
//   calls that take it as `const` may run at the same time as each other.
// - `tactid_identifier_push`, `_estimate` and what else is documented so allocate nothing.

#ifndef TACTID_H
#define TACTID_H

// cbindgen writes this file from crates/capi/src; `make header` does so.

#include <stddef.h>
#include <stdint.h>

/**
 * The motion excites the value, and 1.96 standard deviations are less than the largest value of
 * its kind; of the mass, one standard deviation is at most a quarter of it.
 */
#define TACTID_IDENTIFIABLE 0

/**
 * The motion excites the value, but noise leaves it a wider interval.
 */
#define TACTID_UNCERTAIN 1

/**
 * The motion does not excite the value. Its number is meaningless.
 */
#define TACTID_UNOBSERVABLE 2

/**
 * Wrenches alone: the default.
 */
#define TACTID_METHOD_TACTILE 0

/**
 * Efforts of the joints alone.
 */
#define TACTID_METHOD_EFFORT 1

/**
 * The momentum of a floating base, from its motion alone.
 */
#define TACTID_METHOD_JOINT_SENSING 2

/**
 * All measurements but the efforts.
 */
#define TACTID_METHOD_COMBINED 3

/**
 * All measurements.
 */
#define TACTID_METHOD_COMBINED_WITH_EFFORT 4

/**
 * Efforts contain all that moves and holds arm and payload: the default.
 */
#define TACTID_EFFORT_MEASURED 0

/**
 * Efforts contain all but what holds the arm itself against gravity.
 */
#define TACTID_EFFORT_WITHOUT_GRAVITY 1

/**
 * Efforts contain what the payload needs alone.
 */
#define TACTID_EFFORT_EXTERNAL 2

/**
 * Wrenches are those on the payload: the default.
 */
#define TACTID_ACTS_ON_PAYLOAD 0

/**
 * Wrenches are those on the sensor, which most force-torque sensors report.
 */
#define TACTID_ACTS_ON_SENSOR 1

/**
 * Nothing but a constant was subtracted from the wrenches: the default.
 */
#define TACTID_WRENCH_RAW 0

/**
 * The weight of the configured payload was subtracted, but not the forces that accelerate it.
 */
#define TACTID_WRENCH_WITHOUT_WEIGHT 1

/**
 * The weight of the configured payload and the forces that accelerate it were subtracted.
 */
#define TACTID_WRENCH_CONTACT 2

/**
 * The load is that of the payload that is held, as far as the measurements show.
 */
#define TACTID_SETTLED 0

/**
 * The measurements contradict the load: something touches the payload, or it has changed. The load
 * is held at its last estimate that nothing contradicted, and the standard deviations of the
 * contact contain all of it.
 */
#define TACTID_CHANGING 1

/**
 * What a call returns; negative values are errors, and no estimate has changed then.
 */
enum tactid_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Done. A sample was used.
   */
  TACTID_STATUS_OK = 0,
  /**
   * The sample starts a new stretch without gaps: it is the first, comes after a gap, or follows
   * samples that were earlier, because the clock had gone back.
   */
  TACTID_STATUS_STARTED = 1,
  /**
   * The sample was used, and shows that the payload has changed: the estimate starts again.
   */
  TACTID_STATUS_PAYLOAD_CHANGED = 2,
  /**
   * What is asked for is not known, or not known yet; nothing is written.
   */
  TACTID_STATUS_UNKNOWN = 3,
  /**
   * The sample was used, and shows that the payload before the last change is held again, or
   * that the change was a contact which has ended: the estimate before the change continues.
   */
  TACTID_STATUS_PAYLOAD_RETURNED = 4,
  /**
   * The sample was ignored: a number is not finite or has a magnitude of 1e30 or more, or the
   * time is not later than that of the sample before. The estimate counts it as rejected.
   */
  TACTID_STATUS_REJECTED = -1,
  /**
   * A pointer is null that must not be.
   */
  TACTID_STATUS_NULL_POINTER = -2,
  /**
   * The `size` of a struct is that of no version, or the struct uses a member that this library
   * does not have.
   */
  TACTID_STATUS_WRONG_SIZE = -3,
  /**
   * An array does not have one entry for each joint or six for each sensor, or `base` is given
   * for a fixed base.
   */
  TACTID_STATUS_WRONG_COUNT = -4,
  /**
   * A text is not in UTF-8.
   */
  TACTID_STATUS_INVALID_TEXT = -5,
  /**
   * The URDF is invalid, or lacks a link or a joint; `tactid_last_error` says which.
   */
  TACTID_STATUS_INVALID_ROBOT = -6,
  /**
   * An option is out of range, or does not fit the robot or another option; `tactid_last_error`
   * says which.
   */
  TACTID_STATUS_INVALID_OPTION = -7,
  /**
   * An error of tactid itself, which standard error describes: please report it. Replace the
   * identifier.
   */
  TACTID_STATUS_INTERNAL = -8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum tactid_status tactid_status;
#else
typedef int32_t tactid_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * An online identifier of one payload on one robot.
 */
typedef struct tactid_identifier tactid_identifier;

/**
 * What the findings of an identifier follow from, as of one sample.
 */
typedef struct tactid_snapshot tactid_snapshot;

/**
 * How samples are measured and used. Zero in any member but `size` means its default. Names are
 * those of the options of tactid in Python where both have one, and so are those in findings.
 */
typedef struct tactid_options {
  /**
   * `sizeof(tactid_options)`.
   */
  size_t size;
  /**
   * The measurements that the payload is identified from: one of `TACTID_METHOD_...`.
   */
  uint32_t method;
  /**
   * Nonzero: the base of the robot floats, and each sample has its state. Default: it is fixed
   * to the ground.
   */
  uint32_t floating_base;
  /**
   * Names of the links in whose frames the wrenches are measured: `sensor_count` texts. Default:
   * one sensor in the frame of the tip for the tactile method, none for others.
   */
  const char *const *sensors;
  /**
   * Number of wrench sensors.
   */
  size_t sensor_count;
  /**
   * Gravitational acceleration in the inertial frame, m/s², pointing down: three numbers.
   * Default: 9.81 along -z for a fixed base, none for a floating one.
   */
  const double *gravity;
  /**
   * Frequency at which the low-pass on both sides of the equations has lost 3 dB, Hz.
   * Default: 10.
   */
  double cutoff_hz;
  /**
   * Longest time between two samples across which the motion is differentiated, s. Default: 0.1.
   */
  double max_gap_s;
  /**
   * Nonzero: the wrenches have an unknown constant offset, such as a sensor zero that was not
   * set, which is estimated, too. Default: they have none.
   */
  uint32_t wrench_offset;
  /**
   * What efforts contain: one of `TACTID_EFFORT_...`.
   */
  uint32_t efforts_are;
  /**
   * Name of the link along whose axes the wrenches are expressed, or `world`. Default: the axes
   * of each sensor's own frame. Moments are about the origin of the sensor's frame in any case.
   */
  const char *wrench_axes;
  /**
   * Standard deviations of the white noise of one sample of each wrench sensor: three forces, N,
   * three moments, N m. Default: estimated from the data.
   */
  const double *wrench_noise;
  /**
   * Standard deviation of the white noise of one sample of each joint effort, N m or N. Default:
   * estimated from the data.
   */
  double effort_noise;
  /**
   * The payload that is configured in the controller, which subtracts it from the wrenches as
   * `wrench_is` says, in the tip's frame: mass, kg; centre of mass, m; inertia about it, kg m²
   * (xx, xy, xz, yy, yz, zz). Default: none.
   */
  const double *configured_payload;
  /**
   * What was subtracted from the wrenches: one of `TACTID_WRENCH_...`. All but the default need
   * `configured_payload`.
   */
  uint32_t wrench_is;
  /**
   * Channels of the only wrench sensor that measure nothing: bit k is channel k of three forces,
   * then three moments.
   */
  uint32_t unmeasured;
  /**
   * Name of the link about whose origin the moments of load and contact are; it does not move
   * relative to the tip. Default: the tip.
   */
  const char *contact_point;
  /**
   * Name of the link along whose axes load and contact are expressed, or `world`; it does not
   * move relative to the tip or to the ground. Default: the link of `contact_point`.
   */
  const char *contact_axes;
  /**
   * Body on which the wrenches of the samples act: one of `TACTID_ACTS_ON_...`. Wrenches that
   * calls return have the sign of those of the samples.
   */
  uint32_t wrench_acts_on;
  /**
   * Delay of the wrenches relative to the joints of the same sample, s, between -1 and 1: it is
   * subtracted from their times, and estimates lag the samples by as much. Default: 0.
   */
  double delay_s;
  /**
   * A known body that the measured load contains besides the payload, as a gripper beyond the
   * sensor, in the tip's frame: ten numbers as those of `configured_payload`. Default: none.
   */
  const double *known_tool;
  /**
   * Standard deviations of the ten numbers of `known_tool`, which are part of those of the
   * payload. Default: it is exact.
   */
  const double *known_tool_std_devs;
} tactid_options;

/**
 * What a robot measures at one time. Arrays of joints are in the order of the names that the
 * identifier was created with.
 */
typedef struct tactid_sample {
  /**
   * `sizeof(tactid_sample)`.
   */
  size_t size;
  /**
   * Time on one clock for all samples, s.
   */
  double time_s;
  /**
   * Number of joints in each array of joints: that of the names.
   */
  size_t joint_count;
  /**
   * Positions of the joints, rad, or m for a prismatic joint.
   */
  const double *position;
  /**
   * Velocities of the joints, rad/s or m/s. Default: differentiated from the positions of
   * neighbouring samples.
   */
  const double *velocity;
  /**
   * Efforts of the joint motors, N m or N, gravity and payload included. Only methods with
   * efforts use them.
   */
  const double *effort;
  /**
   * Number of wrenches: that of the sensors.
   */
  size_t wrench_count;
  /**
   * Wrench of each sensor in its frame and about its origin: three forces, N, then three
   * moments, N m. It acts on the payload unless the option `wrench_acts_on` says otherwise.
   */
  const double *wrenches;
  /**
   * State of a floating base in the inertial frame, 13 numbers: position, m; orientation as a
   * quaternion x, y, z, w, from the base to the inertial frame; velocity of its origin, m/s;
   * angular velocity, rad/s. Null for a fixed base.
   */
  const double *base;
  /**
   * Acceleration of the base's origin without gravity, m/s², and angular acceleration, rad/s²,
   * in the inertial frame: six numbers. Default: differentiated from the velocities of
   * neighbouring samples.
   */
  const double *base_acceleration;
} tactid_sample;

/**
 * The identified payload. The ten values are mass, kg; centre of mass in the tip's frame, m;
 * inertia about the centre of mass along the axes of the tip's frame, kg m² (xx, xy, xz, yy, yz,
 * zz).
 */
typedef struct tactid_estimate {
  /**
   * `sizeof(tactid_estimate)`.
   */
  size_t size;
  /**
   * The ten values.
   */
  double values[10];
  /**
   * Standard deviation of each value, in its unit; infinite where the value is unobservable, or
   * divided by a mass that is not known to a quarter.
   */
  double std_devs[10];
  /**
   * Limits of the 95 % interval of each value, in its unit; infinite where nothing bounds it.
   */
  double intervals[10][2];
  /**
   * Covariance of the linear parameters: mass, kg; mass times centre of mass, kg m; inertia
   * about the origin of the tip's frame, kg m², in the order of the values. An unobservable
   * direction has the variance of parameters of plausible size. NaN during the first seven
   * windows, in which the noise is not known, and while nothing explains the windows since a
   * payload change.
   */
  double covariance[10][10];
  /**
   * What the motion shows of each value: `TACTID_IDENTIFIABLE`, `TACTID_UNCERTAIN` or
   * `TACTID_UNOBSERVABLE`.
   */
  uint32_t observability[10];
  /**
   * 1 where a body with these values can exist, within 1 % of its largest principal moment,
   * else 0.
   */
  uint32_t is_physical;
  /**
   * 1 where the estimate is that of the payload that is held now: at least 32 windows contribute
   * to it, the most recent ones show no evidence of a change, and since the last change they show
   * a payload that no contact could be; else 0.
   */
  uint32_t is_settled;
  /**
   * The ten values of the payload before the last change; NaN before a change, and where it had
   * not been known long enough.
   */
  double values_before[10];
  /**
   * Standard deviations of those values, as `std_devs`.
   */
  double std_devs_before[10];
  /**
   * Time of the last payload change on the samples' clock, s, or minus infinity: the estimate
   * uses the samples after it.
   */
  double since_s;
  /**
   * Number of payload changes.
   */
  uint64_t payload_changes;
  /**
   * Number of averaging windows, those before a payload change included.
   */
  uint64_t windows;
  /**
   * Number of samples that were ignored, because of a number that is not finite or a time that
   * is not later than the one before.
   */
  uint64_t rejected;
  /**
   * Number of gaps between samples that were too long to be bridged.
   */
  uint64_t gaps;
  /**
   * 1 where the motion has determined what the wrench of a contact is measured against: mass and
   * centre of mass of the load, and the offset where it is an unknown; else 0.
   */
  uint32_t knows_weight;
  /**
   * 1 while `tactid_identifier_hold_payload` holds the payload, else 0.
   */
  uint32_t is_held;
} tactid_estimate;

/**
 * A wrench with its uncertainty. Force, N, comes before moment, N m. The sign is that of the
 * measured wrenches, see `wrench_acts_on`.
 */
typedef struct tactid_wrench {
  /**
   * `sizeof(tactid_wrench)`.
   */
  size_t size;
  /**
   * Force, then moment; NaN for a channel of a contact that the sensor does not measure.
   */
  double values[6];
  /**
   * Standard deviation of each value, in its unit; infinite where the motion does not determine
   * it, or the sensor does not measure it, NaN where it is not estimated.
   */
  double std_devs[6];
  /**
   * Covariance of the values; NaN for an offset.
   */
  double covariance[6][6];
  /**
   * Time to which the wrench belongs, on the clock of the samples, s: earlier than that of the
   * last sample by the latency of the filter, 28 ms and some samples at a cutoff of 10 Hz. NaN
   * for an offset.
   */
  double time_s;
  /**
   * `TACTID_SETTLED` or `TACTID_CHANGING`.
   */
  uint32_t state;
  /**
   * Always 0.
   */
  uint32_t reserved;
} tactid_wrench;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns the version of the library, such as `0.1.0`. The text is static.
 */
const char *tactid_version(void);

/**
 * Returns what a status means, in English, also of a number that is none. The text is static.
 */
const char *tactid_status_text(int32_t status);

/**
 * Copies why the last `tactid_identifier_new` of this thread failed, in English, and returns the
 * number of bytes that the whole text needs with the zero at its end. A buffer that is shorter
 * gets the beginning of the text; it may be null where `size` is 0.
 *
 * # Safety
 * `buffer` is null, or has `size` writable bytes.
 */
size_t tactid_last_error(char *buffer, size_t size);

/**
 * Creates an identifier for the robot of a URDF, given as its text, whose end-effector frame is
 * the link `tip`.
 *
 * `joints` has the `joint_count` names of the joints in the order in which samples have them. It
 * must name all joints that move the tip or a sensor; others may be missing and count as zero, and
 * names that the robot does not have are ignored. Methods that use efforts or the momentum of a
 * floating base need all joints. `options` may be null: all then have their defaults.
 * `*identifier` is the caller's, who ends it with `tactid_identifier_free`; it is null after an
 * error, whose text `tactid_last_error` returns.
 *
 * Allocates; some 1 ms.
 *
 * # Safety
 * Texts end with zero, and pointers are null or point to what is documented.
 */
tactid_status tactid_identifier_new(const char *urdf,
                                    const char *tip,
                                    const char *const *joints,
                                    size_t joint_count,
                                    const struct tactid_options *options,
                                    struct tactid_identifier **identifier);

/**
 * Ends an identifier. Null is allowed.
 *
 * # Safety
 * `identifier` is null, or was created here and not ended before, and no call uses it.
 */
void tactid_identifier_free(struct tactid_identifier *identifier);

/**
 * Adds one sample, and answers `TACTID_STATUS_OK`, `TACTID_STATUS_STARTED`,
 * `TACTID_STATUS_PAYLOAD_CHANGED` or `TACTID_STATUS_PAYLOAD_RETURNED`, or an error.
 *
 * Allocates nothing; some 2 µs, and some 100 µs at three samples of the first second.
 *
 * # Safety
 * `identifier` was created here, and the arrays of the sample have the documented lengths.
 */
tactid_status tactid_identifier_push(struct tactid_identifier *identifier,
                                     const struct tactid_sample *sample);

/**
 * Completes the update by the most recent window at once, so that the estimate includes it: after
 * the last sample of a recording. In a control loop, the samples that follow do the same.
 * Allocates nothing.
 *
 * # Safety
 * `identifier` was created here.
 */
tactid_status tactid_identifier_finish(struct tactid_identifier *identifier);

/**
 * Writes what is known now into a struct of the caller, as far as its `size` has room. Allocates
 * nothing; some 0.1 µs.
 *
 * # Safety
 * `identifier` was created here, and `estimate` has `size` writable bytes.
 */
tactid_status tactid_identifier_estimate(const struct tactid_identifier *identifier,
                                         struct tactid_estimate *estimate);

/**
 * Writes the constant offset of the wrenches, which a measured wrench contains. It is expressed in
 * the frame of the sensor where there is one that does not move relative to the tip, and otherwise
 * it is that of the sum of the wrenches in the tip's frame. Answers `TACTID_STATUS_UNKNOWN` where
 * the option `wrench_offset` is not set, and before the first window. Allocates nothing.
 *
 * # Safety
 * `identifier` was created here, and `offset` has `size` writable bytes.
 */
tactid_status tactid_identifier_wrench_offset(const struct tactid_identifier *identifier,
                                              struct tactid_wrench *offset);

/**
 * Writes the wrench by which the robot carries and accelerates the payload: what the sensors would
 * measure of it without offset, noise and contact. Frame and answers are those of
 * `tactid_identifier_contact_wrench`. Allocates nothing.
 *
 * # Safety
 * `identifier` was created here, and `load` has `size` writable bytes.
 */
tactid_status tactid_identifier_load_wrench(const struct tactid_identifier *identifier,
                                            struct tactid_wrench *load);

/**
 * Writes the wrench of a contact: the measured wrench less offset and load, all behind the same
 * causal low-pass with the cutoff `cutoff_hz`. It has the sign of the measured wrenches: where
 * these act on the payload, it is what the payload exerts on what it touches; where they act on the
 * sensor, it is what acts on the payload from outside. Its moment is about the origin of the link
 * `contact_point`, and its axes are those of `contact_axes`.
 *
 * What the load does not explain may be a contact or a payload change, and the first samples do
 * not show which: `state` is then `TACTID_CHANGING`. Answers `TACTID_STATUS_UNKNOWN` before 32
 * windows determine the load for the first time, after a gap, and for methods without wrenches.
 * Channels that the sensor does not measure are NaN, with an infinite variance. Allocates nothing.
 *
 * # Safety
 * `identifier` was created here, and `contact` has `size` writable bytes.
 */
tactid_status tactid_identifier_contact_wrench(const struct tactid_identifier *identifier,
                                               struct tactid_wrench *contact);

/**
 * Holds the payload (nonzero), from when it has settled until the gripper opens, or ends that
 * (zero). Samples of such a time neither update the estimate nor show a payload change, and
 * whatever the load does not explain is a contact. A payload that fewer than 32 windows determine
 * is not held: `TACTID_STATUS_UNKNOWN`. Allocates nothing.
 *
 * # Safety
 * `identifier` was created here.
 */
tactid_status tactid_identifier_hold_payload(struct tactid_identifier *identifier,
                                             uint32_t is_held);

/**
 * Sets the zero of the sensor, as after its drift, and keeps the estimate of the payload: the
 * samples that follow determine the offset of the wrenches anew, the first of them within 0.2 s at
 * a cutoff of 10 Hz. A payload change that was the zero's is taken back. Nothing may touch the
 * payload meanwhile; the arm may move. Answers `TACTID_STATUS_UNKNOWN`, and does nothing, where the
 * option `wrench_offset` is not set, before 32 windows determine the load for the first time, and
 * while the payload is held. Allocates nothing.
 *
 * # Safety
 * `identifier` was created here.
 */
tactid_status tactid_identifier_tare(struct tactid_identifier *identifier);

/**
 * Creates a snapshot of an identifier for `tactid_snapshot_findings`. It is the caller's, who ends
 * it with `tactid_snapshot_free`, and needs its identifier only for an update. `*snapshot` is null
 * after an error. Allocates.
 *
 * # Safety
 * `identifier` was created here, and `snapshot` is writable.
 */
tactid_status tactid_snapshot_new(const struct tactid_identifier *identifier,
                                  struct tactid_snapshot **snapshot);

/**
 * Ends a snapshot. Null is allowed.
 *
 * # Safety
 * `snapshot` is null, or was created here and not ended before, and no call uses it.
 */
void tactid_snapshot_free(struct tactid_snapshot *snapshot);

/**
 * Updates a snapshot by the identifier of which it was made, in the control loop, while no other
 * thread uses the snapshot. Allocates nothing.
 *
 * # Safety
 * `identifier` and `snapshot` were created here.
 */
tactid_status tactid_snapshot_update(struct tactid_snapshot *snapshot,
                                     const struct tactid_identifier *identifier);

/**
 * Copies what the most recent samples show about the assumptions: a wrong sign, an offset,
 * velocities in other units. Each finding is a line that begins with `contradicts: `, `doubts: `
 * or `notes: `, the gravest first; the text is empty where there is none. `*needed`, where it is
 * not null, becomes the number of bytes that the whole text needs with the zero at its end. A
 * buffer that is shorter gets the beginning of the text; it may be null where `size` is 0.
 *
 * Allocates; some 20 ms: call it in another thread than that of the control loop.
 *
 * # Safety
 * `snapshot` was created here, `buffer` is null or has `size` writable bytes, and `needed` is
 * null or writable.
 */
tactid_status tactid_snapshot_findings(const struct tactid_snapshot *snapshot,
                                       char *buffer,
                                       size_t size,
                                       size_t *needed);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TACTID_H */
