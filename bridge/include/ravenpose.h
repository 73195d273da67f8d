/* ravenpose: publish RAVEN-II's raven_state, read the corrected pose. Research software, no clinical use.
 *
 * Generated from bridge/src/lib.rs and wire/src by bridge/tests/header.rs: do not edit.
 *
 * Consumer rule: use corrected position and orientation only if the layout version matches, the sequence has advanced, the age is below
 * RAVENPOSE_POSE_AGE_MAX_NS and no less than -1 ms (that is another clock), and the status is RAVENPOSE_STATUS_VALID; otherwise use
 * the raw ones. ravenpose_position() and ravenpose_orientation() do this.
 *
 * Pointers may be null (an error code); otherwise they must be valid. A handle may be used by any thread, one at a time.
 */

#ifndef RAVENPOSE_H
#define RAVENPOSE_H

#include <stddef.h>
#include <stdint.h>

/* Result codes: negative ones are errors, ravenpose_error_text() explains them. */
#define RAVENPOSE_OK (0)
#define RAVENPOSE_NOTHING_NEW (1)
#define RAVENPOSE_RAW (2)
#define RAVENPOSE_ERROR_NULL (-1)
#define RAVENPOSE_ERROR_VERSION (-2)
#define RAVENPOSE_ERROR_ARGUMENT (-3)
#define RAVENPOSE_ERROR_TRANSPORT (-4)
#define RAVENPOSE_ERROR_FULL (-5)
#define RAVENPOSE_ERROR_FOREIGN (-6)
#define RAVENPOSE_ERROR_LOAN (-7)
#define RAVENPOSE_ERROR_SEND (-8)
#define RAVENPOSE_ERROR_RECEIVE (-9)
#define RAVENPOSE_ERROR_TORN (-10)
#define RAVENPOSE_ERROR_INTERNAL (-11)
#define RAVENPOSE_ERROR_ABSENT (-12)

/* Status of an arm's estimate. */
#define RAVENPOSE_STATUS_ABSENT 0u
#define RAVENPOSE_STATUS_STARTING 1u
#define RAVENPOSE_STATUS_VALID 2u
#define RAVENPOSE_STATUS_FALLBACK 3u

/* Flags of an arm's estimate: bits 0 to 15 are reasons for fallback, the others inform (docs/flags.md). */
#define RAVENPOSE_FLAG_INPUT_NOT_FINITE (1u << 0)
#define RAVENPOSE_FLAG_INPUT_STALE (1u << 1)
#define RAVENPOSE_FLAG_INPUT_IMPOSSIBLE (1u << 2)
#define RAVENPOSE_FLAG_OUT_OF_RANGE (1u << 3)
#define RAVENPOSE_FLAG_OUT_OF_DOMAIN (1u << 4)
#define RAVENPOSE_FLAG_INPUT_FROZEN (1u << 5)
#define RAVENPOSE_FLAG_OUTPUT_NOT_FINITE (1u << 6)
#define RAVENPOSE_FLAG_OUTPUT_BEYOND_BOUND (1u << 7)
#define RAVENPOSE_FLAG_BUDGET_EXCEEDED (1u << 8)
#define RAVENPOSE_FLAG_MODEL_REJECTED (1u << 9)
#define RAVENPOSE_FLAG_UNTRAINED (1u << 10)
#define RAVENPOSE_FLAG_NO_MODEL (1u << 11)
#define RAVENPOSE_FLAG_SETTLING (1u << 12)
#define RAVENPOSE_FLAG_NEW_SOURCE (1u << 13)
#define RAVENPOSE_FLAG_STOPPING (1u << 14)
#define RAVENPOSE_FLAG_STATE_NOT_ALLOWED (1u << 15)
#define RAVENPOSE_FLAG_RECOVERING (1u << 16)
#define RAVENPOSE_FLAG_RATE_LIMITED (1u << 17)
#define RAVENPOSE_FLAG_LATE (1u << 18)
#define RAVENPOSE_FLAG_DEGRADED (1u << 19)
#define RAVENPOSE_FLAG_NOT_REALTIME (1u << 20)
#define RAVENPOSE_FLAG_UNTRAINED_ALLOWED (1u << 21)
#define RAVENPOSE_FLAG_SAW_DUPLICATE (1u << 22)
#define RAVENPOSE_FLAG_RESET (1u << 23)
#define RAVENPOSE_FLAG_MEMORY_UNSETTLED (1u << 24)
#define RAVENPOSE_FLAG_UNSEEN_LOAD (1u << 25)
#define RAVENPOSE_FLAG_LOAD_UNWEIGHED (1u << 26)
#define RAVENPOSE_FLAG_UNSEEN_FRICTION (1u << 27)

/* Arms. */
#define RAVENPOSE_GOLD 0u
#define RAVENPOSE_GREEN 1u

/* Layout versions of the messages. */
#define RAVENPOSE_STATE_VERSION 1u
#define RAVENPOSE_POSE_VERSION 1u


/*
 Version of this interface. `ravenpose_*_open` refuses a caller that was compiled against another one.
 */
#define RAVENPOSE_ABI_VERSION 1

/*
 Age beyond which a pose must not be used, ns (the consumer rule).
 */
#define RAVENPOSE_POSE_AGE_MAX_NS 5000000

/*
 A reader of poses.
 */
typedef struct ravenpose_pose_reader ravenpose_pose_reader;

/*
 The one publisher of states.
 */
typedef struct ravenpose_publisher ravenpose_publisher;

/*
 One cycle of RAVEN's controller, as its `raven_state` message has it (units as published: µm, degrees; joint 3 in
 m × 57.29578). Arrays of 16 are `8 * arm + slot`, slot 3 belongs to no joint; arm 0 is gold (left), arm 1 green (right).

 Source of the fields: `raven_2/raven_state`, MD5 `ce9e7f4969049d8bb365de3c98461a01`.
 */
typedef struct ravenpose_state {
  /*
   Layout version, [`STATE_VERSION`].
   */
  uint32_t version;
  /*
   Size of this struct in bytes.
   */
  uint32_t size;
  /*
   Equals `sequence`; written first.
   */
  uint64_t guard_head;
  /*
   Chosen at random when the publisher opens: another value is another run of the control process.
   */
  uint64_t source_id;
  /*
   Counts up by one per control cycle, starting at 1.
   */
  uint64_t sequence;
  /*
   `CLOCK_MONOTONIC` of the control cycle, ns.
   */
  int64_t source_time_ns;
  /*
   Bit 0: gold arm connected, bit 1: green arm connected; 0: as `type_` tells.
   */
  uint32_t arms;
  /*
   `hdr.seq`.
   */
  uint32_t hdr_seq;
  /*
   `hdr.stamp.sec`, wall clock, s.
   */
  uint32_t hdr_stamp_sec;
  /*
   `hdr.stamp.nsec`, ns.
   */
  uint32_t hdr_stamp_nsec;
  /*
   0 e-stop, 1 initialising, 2 pedal up, 3 pedal down.
   */
  int32_t runlevel;
  /*
   0..3 while initialising.
   */
  int32_t sublevel;
  /*
   Last teleoperation packet number.
   */
  int32_t last_seq;
  /*
   `type`: serial number of each arm's USB board, 0 if not connected.
   */
  int32_t type_[2];
  /*
   Reported tip position, µm, frame 0 of the arm; `3 * arm + axis`.
   */
  int32_t pos[6];
  /*
   Reported tip rotation, row-major; `9 * arm + 3 * row + column`.
   */
  float ori[18];
  /*
   Commanded tip rotation, as `ori`.
   */
  float ori_d[18];
  /*
   Commanded tip position, µm.
   */
  int32_t pos_d[6];
  /*
   Time since the previous publication: whole seconds.
   */
  int32_t dt_sec;
  /*
   Time since the previous publication: the rest, ns.
   */
  int32_t dt_nsec;
  /*
   `encVals`: raw encoder counts.
   */
  int32_t enc_vals[16];
  /*
   Amplifier command after clipping, counts.
   */
  int32_t dac_val[16];
  /*
   Desired torque at the capstan before clipping, N·m.
   */
  float tau[16];
  /*
   Motor angle, degrees.
   */
  float mpos[16];
  /*
   Joint position from the motors, degrees; joint 3: m × 57.29578.
   */
  float jpos[16];
  /*
   Motor speed, degrees/s.
   */
  float mvel[16];
  /*
   Joint speed without coupling, degrees/s; joint 3: m/s × 57.29578.
   */
  float jvel[16];
  /*
   Commanded motor angle, degrees.
   */
  float mpos_d[16];
  /*
   Commanded joint position, degrees; joint 3: m × 57.29578.
   */
  float jpos_d[16];
  /*
   Commanded jaw opening, rad.
   */
  float grasp_d[2];
  /*
   Encoder count at motor zero.
   */
  float encoffsets[16];
  /*
   `jac_vel` as published; no physical unit.
   */
  float jac_vel[12];
  /*
   `jac_f` as published, identical to `jac_vel`.
   */
  float jac_f[12];
  /*
   Zero.
   */
  uint32_t reserved;
  /*
   Equals `sequence`; written last.
   */
  uint64_t guard_tail;
} ravenpose_state;

/*
 What `open` wants to know. Initialise it with `RAVENPOSE_OPTIONS_INIT`; zero or null means the default.
 */
typedef struct ravenpose_options {
  /*
   `RAVENPOSE_ABI_VERSION` as the caller was compiled with.
   */
  uint32_t abi_version;
  /*
   `sizeof(ravenpose_state)` as the caller was compiled with.
   */
  uint32_t state_size;
  /*
   `sizeof(ravenpose_pose)` as the caller was compiled with.
   */
  uint32_t pose_size;
  /*
   Readers: messages kept while nobody takes them, 1 to 256 (0: 1, the newest only).
   */
  uint32_t queue_depth;
  /*
   Zero.
   */
  uint32_t reserved[2];
  /*
   Prefix of the shared files (null: `RAVENPOSE_PREFIX`, else `iox2_`).
   */
  const char *prefix;
  /*
   Root of the shared files (null: `RAVENPOSE_ROOT`, else `/tmp/iceoryx2/`).
   */
  const char *root;
} ravenpose_options;

/*
 The estimate for one arm, in frame 0 of the arm: positions in micrometres, rotations in degrees.
 */
typedef struct ravenpose_arm_pose {
  /*
   An [`ArmStatus`]: use `corrected_position_um` and `corrected_orientation` only when it is `valid`.
   */
  uint32_t status;
  /*
   Bits of [`crate::flag`]: why, and what else to know.
   */
  uint32_t flags;
  /*
   First eight bytes of the SHA-256 of the position's model file, big-endian (prints as the hash begins); 0 without a model.
   */
  uint64_t model_id;
  /*
   Goes up by one whenever the correction drops to zero at once (an announced step); a restarted service begins with another one.
   */
  uint32_t reset_count;
  /*
   Distance from the trained domain, 1 = its edge, the larger one of the arm's models; -1 where it was not computed.
   */
  float domain_score;
  /*
   Position as RAVEN reports it, µm.
   */
  double raw_position_um[3];
  /*
   What was added, µm; zero unless `status` is valid.
   */
  double correction_um[3];
  /*
   `raw_position_um + correction_um`, µm.
   */
  double corrected_position_um[3];
  /*
   Half width per axis that holds the true position with 95 %, µm; NaN while the model states none.
   */
  double bound95_um[3];
  /*
   Rotation as RAVEN reports it, row-major, bit for bit.
   */
  float orientation[9];
  /*
   Good cycles still wanted before the correction returns.
   */
  uint32_t hold_cycles;
  /*
   As `model_id`, of the model that corrects the orientation; 0 without one: then it is RAVEN's own in every status.
   */
  uint64_t orientation_model_id;
  /*
   What the orientation was turned by, a rotation vector in the axes of frame 0, degrees; zero unless `status` is valid.
   */
  double rotation_deg[3];
  /*
   Half width per axis of `rotation_deg` that holds the true rotation with 95 %, degrees; NaN while the model states none.
   */
  double rotation_bound95_deg[3];
  /*
   `exp(rotation_deg)` times `orientation`, row-major; bit for bit `orientation` where the rotation is zero.
   */
  float corrected_orientation[9];
  /*
   Zero.
   */
  uint32_t reserved;
} ravenpose_arm_pose;

/*
 What the service publishes once per cycle.
 */
typedef struct ravenpose_pose {
  /*
   Layout version, [`POSE_VERSION`].
   */
  uint32_t version;
  /*
   Size of this struct in bytes.
   */
  uint32_t size;
  /*
   Equals `sequence`; written first.
   */
  uint64_t guard_head;
  /*
   Counts up by one per published message; a restarted service goes on from a higher number.
   */
  uint64_t sequence;
  /*
   `source_id` of the state that this answers.
   */
  uint64_t source_id;
  /*
   `sequence` of the state that this answers.
   */
  uint64_t source_sequence;
  /*
   `source_time_ns` of the state that this answers, `CLOCK_MONOTONIC`, ns.
   */
  int64_t source_time_ns;
  /*
   When the cycle took the state (or, without one, began), `CLOCK_MONOTONIC`, ns.
   */
  int64_t start_time_ns;
  /*
   When this message was handed over, `CLOCK_MONOTONIC`, ns.
   */
  int64_t publish_time_ns;
  /*
   Connected arms: bit 0 gold, bit 1 green.
   */
  uint32_t arms;
  /*
   `runlevel` of the state.
   */
  int32_t runlevel;
  /*
   Cycles since the service started, idle ones included.
   */
  uint64_t cycles;
  /*
   States that never arrived (gaps in the source sequence).
   */
  uint64_t lost;
  /*
   States that arrived but were overtaken by a newer one in the same cycle.
   */
  uint64_t skipped;
  /*
   States that arrived more than once.
   */
  uint64_t duplicates;
  /*
   States older than one already taken.
   */
  uint64_t out_of_order;
  /*
   Messages refused: other layout, torn, or a time in the future.
   */
  uint64_t refused;
  /*
   Cycles that took longer than the budget.
   */
  uint64_t late;
  /*
   Cycles that took longer than the period.
   */
  uint64_t overruns;
  /*
   Gold, green.
   */
  struct ravenpose_arm_pose arm[2];
  /*
   Equals `sequence`; written last.
   */
  uint64_t guard_tail;
} ravenpose_pose;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Version of this library's interface.
 */
uint32_t ravenpose_abi_version(void);

/*
 What a code means; a static text, never null.
 */
const char *ravenpose_error_text(int32_t code);

/*
 `CLOCK_MONOTONIC` in ns, the clock of all messages.
 */
int64_t ravenpose_now_ns(void);

/*
 Makes `state` a state of zeros with a valid version and size.
 */
int32_t ravenpose_state_init(struct ravenpose_state *state);

/*
 Opens the one publisher of states. Not real-time: call it before the control loop. On failure `message` (may be null) gets one line.
 */
int32_t ravenpose_publisher_open(const struct ravenpose_options *options,
                                 struct ravenpose_publisher **publisher,
                                 char *message,
                                 size_t message_size);

/*
 Gives a place in shared memory to write the next state into: zeros, with version, size, source and the next sequence number set.
 Asked again before `send`, it gives the same place. Nothing is visible before `send`.
 */
int32_t ravenpose_publisher_loan(struct ravenpose_publisher *publisher,
                                 struct ravenpose_state **state);

/*
 Hands the loaned state over. Sets the guard words, `source_time_ns` if it is 0, and `arms` if it is 0.
 */
int32_t ravenpose_publisher_send(struct ravenpose_publisher *publisher);

/*
 Copies `state` and hands it over: `loan`, copy, `send` in one call. A sequence number of 0 means the next one.
 */
int32_t ravenpose_publisher_publish(struct ravenpose_publisher *publisher, const struct ravenpose_state *state);

/*
 Readers of states that are connected now; 0 for null.
 */
uint32_t ravenpose_publisher_readers(const struct ravenpose_publisher *publisher);

/*
 Closes the publisher and sets the caller's pointer to null. Null is allowed.
 */
void ravenpose_publisher_close(struct ravenpose_publisher **publisher);

/*
 Opens a reader of poses. Not real-time. On failure `message` (may be null) gets one line.
 */
int32_t ravenpose_pose_reader_open(const struct ravenpose_options *options,
                                   struct ravenpose_pose_reader **reader,
                                   char *message,
                                   size_t message_size);

/*
 Takes the newest pose that was not taken yet. `RAVENPOSE_NOTHING_NEW` leaves `pose` as it is.
 */
int32_t ravenpose_pose_reader_take(struct ravenpose_pose_reader *reader, struct ravenpose_pose *pose);

/*
 Takes the oldest pose that still waits in the queue (for recorders). `RAVENPOSE_NOTHING_NEW` leaves `pose` as it is.
 */
int32_t ravenpose_pose_reader_next(struct ravenpose_pose_reader *reader, struct ravenpose_pose *pose);

/*
 Waits for a pose that was not taken yet, at most `timeout_ns`, looking every 50 µs, and takes the newest. Not for a real-time
 thread: it sleeps, and after half a second of silence it makes sure that it still listens to the living service.
 */
int32_t ravenpose_pose_reader_wait(struct ravenpose_pose_reader *reader,
                                   int64_t timeout_ns,
                                   struct ravenpose_pose *pose);

/*
 Closes the reader and sets the caller's pointer to null. Null is allowed.
 */
void ravenpose_pose_reader_close(struct ravenpose_pose_reader **reader);

/*
 The consumer rule for one arm (0 gold, 1 green) at the time `now_ns`: writes the corrected position if it may be used, else the raw
 one, in µm, frame 0 of the arm. Returns `RAVENPOSE_OK` for corrected, `RAVENPOSE_RAW` for raw, a negative code for bad arguments.
 */
int32_t ravenpose_position(const struct ravenpose_pose *pose,
                           uint32_t arm,
                           int64_t now_ns,
                           double *position_um);

/*
 The same for the orientation: nine numbers, row-major. Returns `RAVENPOSE_OK` for corrected, `RAVENPOSE_RAW` for RAVEN's own, also
 where no model corrects the orientation, a negative code for bad arguments.
 */
int32_t ravenpose_orientation(const struct ravenpose_pose *pose,
                              uint32_t arm,
                              int64_t now_ns,
                              float *orientation);

/*
 Number of arms in a pose.
 */
uint32_t ravenpose_arms(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* RAVENPOSE_H */


/* Options as this program was compiled: ravenpose_options options = RAVENPOSE_OPTIONS_INIT; */
#define RAVENPOSE_OPTIONS_INIT \
  { RAVENPOSE_ABI_VERSION, (uint32_t)sizeof(ravenpose_state), (uint32_t)sizeof(ravenpose_pose), 0u, {0u, 0u}, NULL, NULL }
