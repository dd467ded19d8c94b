// Calls everything with wrong arguments; built with the address sanitizer. Exits with 1 at the first wrong answer.
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <tactid.h>

#define CHECK(condition)                                               \
  do {                                                                 \
    if (!(condition)) {                                                \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      exit(1);                                                         \
    }                                                                  \
  } while (0)

static const char *URDF =
    "<robot name='wrist'><link name='base'/><link name='yaw'/><link name='pitch'/><link name='tool0'/><link name='jaw'/>"
    "<joint name='joint_1' type='continuous'><parent link='base'/><child link='yaw'/><axis xyz='0 0 1'/></joint>"
    "<joint name='joint_2' type='continuous'><parent link='yaw'/><child link='pitch'/><axis xyz='0 1 0'/></joint>"
    "<joint name='joint_3' type='continuous'><parent link='pitch'/><child link='tool0'/><axis xyz='1 0 0'/></joint>"
    "<joint name='grip' type='continuous'><parent link='tool0'/><child link='jaw'/><axis xyz='1 0 0'/></joint></robot>";
static const char *const JOINTS[] = {"joint_1", "joint_2", "joint_3"};

static tactid_status try_new(const char *urdf, const char *tip, const char *const *joints, size_t count,
                             const tactid_options *options) {
  tactid_identifier *made = (tactid_identifier *)&made;
  const tactid_status status = tactid_identifier_new(urdf, tip, joints, count, options, &made);
  CHECK((made != NULL) == (status == TACTID_STATUS_OK));
  tactid_identifier_free(made);
  return status;
}

static tactid_identifier *created(void) {
  tactid_identifier *made = NULL;
  CHECK(tactid_identifier_new(URDF, "tool0", JOINTS, 3, NULL, &made) == TACTID_STATUS_OK);
  return made;
}

static void expect_error(const char *part) {
  char message[1000];
  CHECK(tactid_last_error(message, sizeof message) <= sizeof message);
  if (strstr(message, part) == NULL) {
    fprintf(stderr, "`%s` does not say `%s`\n", message, part);
    exit(1);
  }
}

static void wrong_robots(void) {
  CHECK(try_new(NULL, "tool0", JOINTS, 3, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(try_new(URDF, NULL, JOINTS, 3, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(try_new(URDF, "tool0", NULL, 3, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(try_new(URDF, "tool0", JOINTS, SIZE_MAX, NULL) == TACTID_STATUS_WRONG_COUNT);
  CHECK(tactid_identifier_new(URDF, "tool0", JOINTS, 3, NULL, NULL) == TACTID_STATUS_NULL_POINTER);
  expect_error("null");
  const char *const with_null[] = {"joint_1", NULL, "joint_3"};
  CHECK(try_new(URDF, "tool0", with_null, 3, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(try_new("<robot", "tool0", JOINTS, 3, NULL) == TACTID_STATUS_INVALID_ROBOT);
  CHECK(try_new("\xff", "tool0", JOINTS, 3, NULL) == TACTID_STATUS_INVALID_TEXT);
  CHECK(try_new(URDF, "tool9", JOINTS, 3, NULL) == TACTID_STATUS_INVALID_ROBOT);
  expect_error("tool9");
  CHECK(try_new(URDF, "tool0", JOINTS, 2, NULL) == TACTID_STATUS_INVALID_ROBOT);
  expect_error("joint_3");
  const char *const twice[] = {"joint_1", "joint_2", "joint_3", "joint_2"};
  CHECK(try_new(URDF, "tool0", twice, 4, NULL) == TACTID_STATUS_INVALID_ROBOT);
  expect_error("joint_2");
}

static void wrong_options(void) {
  tactid_options options = {.size = sizeof options};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_OK);
  options.method = 9;
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("method");
  options.method = TACTID_METHOD_JOINT_SENSING;
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_ROBOT);
  expect_error("grip");
  options = (tactid_options){.size = sizeof options, .cutoff_hz = NAN};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("cutoff_hz");
  const double body[10] = {1.0, NAN};
  options = (tactid_options){.size = sizeof options, .configured_payload = body, .wrench_is = 1};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("not finite");
  const double tool[10] = {1.0, 0.0, 0.0, 0.05};
  options = (tactid_options){.size = sizeof options, .configured_payload = tool};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("raw");
  options = (tactid_options){.size = sizeof options, .wrench_is = TACTID_WRENCH_CONTACT};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("missing");
  options = (tactid_options){.size = sizeof options, .wrench_acts_on = 2};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  options = (tactid_options){.size = sizeof options, .delay_s = 1.5};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("delay_s");
  options = (tactid_options){.size = sizeof options, .wrench_axes = "\xff"};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_TEXT);
  options = (tactid_options){.size = sizeof options, .contact_point = "base"};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("`contact_point`: the link `base`");
  options = (tactid_options){.size = sizeof options, .contact_axes = "tool9"};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_OPTION);
  expect_error("`contact_axes`: ");
  options = (tactid_options){.size = sizeof options, .contact_axes = "\xff"};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_INVALID_TEXT);
  options = (tactid_options){.size = sizeof options, .sensor_count = 1};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_NULL_POINTER);
  const size_t sizes[] = {0, sizeof(size_t) - 1, 4097, SIZE_MAX};
  for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
    options = (tactid_options){.size = sizes[k]};
    CHECK(try_new(URDF, "tool0", JOINTS, 3, &options) == TACTID_STATUS_WRONG_SIZE);
  }
  // An older header has fewer members: the rest is not read. A newer one has more, which must be zero.
  size_t *oldest = malloc(sizeof *oldest);
  *oldest = sizeof *oldest;
  CHECK(try_new(URDF, "tool0", JOINTS, 3, (tactid_options *)oldest) == TACTID_STATUS_OK);
  free(oldest);
  struct {
    tactid_options known;
    double added;
  } newer = {{.size = sizeof newer}, 0.0};
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &newer.known) == TACTID_STATUS_OK);
  newer.added = 1.0;
  CHECK(try_new(URDF, "tool0", JOINTS, 3, &newer.known) == TACTID_STATUS_WRONG_SIZE);
}

static void wrong_samples(void) {
  tactid_identifier *identifier = created();
  double position[3] = {0.1, 0.2, 0.3}, wrench[6] = {0}, base[13] = {0};
  const tactid_sample good = {.size = sizeof good, .joint_count = 3, .position = position, .wrench_count = 1, .wrenches = wrench};
  tactid_sample bad = good;
  CHECK(tactid_identifier_push(NULL, &good) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_push(identifier, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_push(identifier, &good) == TACTID_STATUS_STARTED);
  CHECK(tactid_identifier_push(identifier, &good) == TACTID_STATUS_REJECTED);  // not later
  bad.time_s = NAN;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_REJECTED);
  bad.time_s = 0.001;
  position[1] = NAN;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_REJECTED);
  position[1] = 0.2;
  wrench[5] = INFINITY;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_REJECTED);
  wrench[5] = 0.0;
  bad.size = 3;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_WRONG_SIZE);
  bad = good, bad.joint_count = 4;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_WRONG_COUNT);
  bad = good, bad.wrench_count = 2;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_WRONG_COUNT);
  bad = good, bad.base = base;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_WRONG_COUNT);
  bad = good, bad.position = NULL;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_NULL_POINTER);
  bad = good, bad.wrenches = NULL;
  CHECK(tactid_identifier_push(identifier, &bad) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_finish(NULL) == TACTID_STATUS_NULL_POINTER);

  tactid_estimate estimate = {.size = sizeof estimate};
  CHECK(tactid_identifier_estimate(NULL, &estimate) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_estimate(identifier, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_estimate(identifier, &estimate) == TACTID_STATUS_OK);
  CHECK(estimate.rejected == 4 && isnan(estimate.covariance[0][0]));
  tactid_wrench offset = {.size = sizeof offset};
  CHECK(tactid_identifier_wrench_offset(NULL, &offset) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_wrench_offset(identifier, &offset) == TACTID_STATUS_UNKNOWN);
  CHECK(tactid_identifier_contact_wrench(identifier, &offset) == TACTID_STATUS_UNKNOWN);
  CHECK(tactid_identifier_contact_wrench(NULL, &offset) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_load_wrench(identifier, &offset) == TACTID_STATUS_UNKNOWN);
  CHECK(tactid_identifier_load_wrench(NULL, &offset) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_hold_payload(NULL, 1) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_hold_payload(identifier, 2) == TACTID_STATUS_UNKNOWN);
  CHECK(tactid_identifier_tare(NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_identifier_tare(identifier) == TACTID_STATUS_UNKNOWN);
  CHECK(tactid_identifier_estimate(identifier, &estimate) == TACTID_STATUS_OK);
  CHECK(estimate.is_held == 0 && estimate.knows_weight == 0);
  // An older header has a shorter struct: nothing is written beyond it.
  size_t *shorter = malloc(sizeof *shorter + sizeof(double));
  *shorter = sizeof *shorter + sizeof(double);
  CHECK(tactid_identifier_estimate(identifier, (tactid_estimate *)shorter) == TACTID_STATUS_OK);
  CHECK(*shorter == sizeof *shorter + sizeof(double));
  free(shorter);
  estimate.size = 0;
  CHECK(tactid_identifier_estimate(identifier, &estimate) == TACTID_STATUS_WRONG_SIZE);
  tactid_identifier_free(identifier);
  tactid_identifier_free(NULL);
}

static void floating_base(void) {
  tactid_options options = {.size = sizeof options, .floating_base = 1};
  tactid_identifier *identifier = NULL;
  CHECK(tactid_identifier_new(URDF, "tool0", JOINTS, 3, &options, &identifier) == TACTID_STATUS_OK);
  double position[3] = {0}, wrench[6] = {0}, base[13] = {0};
  tactid_sample sample = {.size = sizeof sample, .joint_count = 3, .position = position, .wrench_count = 1, .wrenches = wrench};
  CHECK(tactid_identifier_push(identifier, &sample) == TACTID_STATUS_NULL_POINTER);
  sample.base = base;  // a quaternion of zeros is no orientation
  CHECK(tactid_identifier_push(identifier, &sample) == TACTID_STATUS_REJECTED);
  base[6] = 1.0;
  CHECK(tactid_identifier_push(identifier, &sample) == TACTID_STATUS_STARTED);
  tactid_identifier_free(identifier);
}

// Pushes samples of a swing under no load, and returns the number of windows.
static void *swing(void *argument) {
  tactid_identifier *identifier = created();
  double position[3], wrench[6] = {0};
  tactid_sample sample = {.size = sizeof sample, .joint_count = 3, .position = position, .wrench_count = 1, .wrenches = wrench};
  for (int k = 0; k < 2000; k++) {
    sample.time_s = 1e-3 * k;
    for (int joint = 0; joint < 3; joint++) {
      position[joint] = 0.4 * sin((5 + 2 * joint) * sample.time_s);
    }
    wrench[2] = 9.81 * 0.5;
    CHECK(tactid_identifier_push(identifier, &sample) >= 0);
  }
  CHECK(tactid_identifier_finish(identifier) == TACTID_STATUS_OK);
  *(tactid_identifier **)argument = identifier;
  return NULL;
}

static void two_threads(void) {
  tactid_identifier *found[2];
  pthread_t threads[2];
  for (int k = 0; k < 2; k++) {
    CHECK(pthread_create(&threads[k], NULL, swing, &found[k]) == 0);
  }
  tactid_estimate estimates[2] = {{.size = sizeof *estimates}, {.size = sizeof *estimates}};
  for (int k = 0; k < 2; k++) {
    CHECK(pthread_join(threads[k], NULL) == 0);
    CHECK(tactid_identifier_estimate(found[k], &estimates[k]) == TACTID_STATUS_OK);
  }
  CHECK(memcmp(&estimates[0], &estimates[1], sizeof *estimates) == 0);
  CHECK(estimates[0].windows > 10);

  tactid_wrench contact = {.size = sizeof contact};
  CHECK(tactid_identifier_contact_wrench(found[0], &contact) == TACTID_STATUS_OK);
  CHECK(tactid_identifier_contact_wrench(found[0], NULL) == TACTID_STATUS_NULL_POINTER);
  tactid_snapshot *snapshot = NULL;
  CHECK(tactid_snapshot_new(NULL, &snapshot) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_snapshot_new(found[0], NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_snapshot_new(found[0], &snapshot) == TACTID_STATUS_OK);
  CHECK(tactid_snapshot_update(snapshot, NULL) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_snapshot_update(NULL, found[0]) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_snapshot_update(snapshot, found[0]) == TACTID_STATUS_OK);
  tactid_identifier_free(found[0]);
  size_t needed = 0, again = 0;
  CHECK(tactid_snapshot_findings(NULL, NULL, 0, &needed) == TACTID_STATUS_NULL_POINTER);
  CHECK(tactid_snapshot_findings(snapshot, NULL, 0, &needed) == TACTID_STATUS_OK);
  CHECK(tactid_snapshot_findings(snapshot, NULL, 0, NULL) == TACTID_STATUS_OK);
  CHECK(needed > 1);  // a constant wrench is no payload that moves
  char *text = malloc(needed);
  CHECK(tactid_snapshot_findings(snapshot, text, needed, &again) == TACTID_STATUS_OK);
  CHECK(again == needed && strlen(text) + 1 == needed && text[needed - 2] == '\n');
  char beginning[8];
  CHECK(tactid_snapshot_findings(snapshot, beginning, sizeof beginning, NULL) == TACTID_STATUS_OK);
  CHECK(strlen(beginning) == 7 && strncmp(beginning, text, 7) == 0);
  free(text);
  tactid_snapshot_free(snapshot);
  tactid_snapshot_free(NULL);
  tactid_identifier_free(found[1]);
}

int main(void) {
  CHECK(strlen(tactid_version()) > 0);
  const char *none = tactid_status_text(99);
  for (int status = -20; status < 20; status++) {
    const int is_known = TACTID_STATUS_INTERNAL <= status && status <= TACTID_STATUS_PAYLOAD_RETURNED;
    CHECK((strcmp(tactid_status_text(status), none) != 0) == is_known);
  }
  CHECK(tactid_last_error(NULL, 0) == 1);
  wrong_robots();
  wrong_options();
  wrong_samples();
  floating_base();
  two_threads();
  puts("every answer is right");
  return 0;
}
