// Replays samples in an identifier and writes its estimate and the contact wrench after each, for a comparison with Rust.
//
// replay URDF SAMPLES OUT: the samples are rows of doubles: time; position, velocity of each joint; state of the base; six
// numbers of each of two wrenches. Prints how often memory was allocated between the first sample and the last.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <tactid.h>

#define JOINTS 8
#define ROW (1 + 2 * JOINTS + 13 + 12)

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

// The program's functions come before those of the C library, for libtactid, too.
static size_t allocations;

void *malloc(size_t size) {
  allocations++;
  return __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
  allocations++;
  return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
  allocations++;
  return __libc_realloc(old, size);
}

int posix_memalign(void **out, size_t alignment, size_t size) {
  allocations++;
  *out = __libc_memalign(alignment, size);
  return 0;
}

// Returns the whole file with a zero at its end, and its length.
static char *read_file(const char *path, size_t *length) {
  FILE *file = fopen(path, "rb");
  if (file == NULL || fseek(file, 0, SEEK_END) != 0) {
    exit(3);
  }
  *length = (size_t)ftell(file);
  rewind(file);
  char *content = malloc(*length + 1);
  if (fread(content, 1, *length, file) != *length) {
    exit(3);
  }
  content[*length] = 0;
  fclose(file);
  return content;
}

int main(int argc, char **argv) {
  if (argc != 4) {
    return 2;
  }
  size_t length;
  char *urdf = read_file(argv[1], &length);
  const double *rows = (const double *)read_file(argv[2], &length);
  const size_t count = length / sizeof(double) / ROW;
  // The reverse of the robot's order, and one that it does not have.
  const char *joints[] = {"not_mine", "finger_right_joint", "finger_left_joint", "joint_6", "joint_5",
                          "joint_4",  "joint_3",            "joint_2",           "joint_1"};
  const char *sensors[] = {"finger_left_link", "finger_right_link"};
  tactid_options options = {.size = sizeof options, .floating_base = 1, .sensors = sensors, .sensor_count = 2};
  tactid_identifier *identifier = NULL;
  const size_t at_first = allocations;
  if (tactid_identifier_new(urdf, "tool0", joints, JOINTS + 1, &options, &identifier) != TACTID_STATUS_OK) {
    char message[500];
    tactid_last_error(message, sizeof message);
    fprintf(stderr, "%s\n", message);
    return 1;
  }
  if (allocations < at_first + 10) {
    return 4;  // the library has another allocator, and the count means nothing
  }
  tactid_snapshot *snapshot = NULL;
  if (tactid_snapshot_new(identifier, &snapshot) != TACTID_STATUS_OK) {
    return 1;
  }
  double position[JOINTS + 1] = {7.0}, velocity[JOINTS + 1] = {-7.0};
  tactid_sample sample = {.size = sizeof sample, .joint_count = JOINTS + 1, .position = position,
                          .velocity = velocity, .wrench_count = 2};
  tactid_estimate estimate = {.size = sizeof estimate};
  tactid_wrench contact = {.size = sizeof contact}, load = {.size = sizeof load};
  const size_t of_estimate = sizeof estimate - sizeof estimate.size;
  const size_t bytes = of_estimate + sizeof contact.values + sizeof load.values;
  char *estimates = malloc(count * bytes);
  const size_t before = allocations;
  for (size_t k = 0; k < count; k++) {
    const double *row = rows + k * ROW;
    for (size_t joint = 0; joint < JOINTS; joint++) {
      position[JOINTS - joint] = row[1 + joint];
      velocity[JOINTS - joint] = row[1 + JOINTS + joint];
    }
    sample.time_s = row[0];
    sample.base = row + 1 + 2 * JOINTS;
    sample.wrenches = sample.base + 13;
    if (tactid_identifier_push(identifier, &sample) < 0 ||
        tactid_identifier_estimate(identifier, &estimate) != TACTID_STATUS_OK ||
        tactid_identifier_contact_wrench(identifier, &contact) < 0 ||
        tactid_identifier_load_wrench(identifier, &load) < 0 ||
        tactid_snapshot_update(snapshot, identifier) != TACTID_STATUS_OK) {
      return 1;
    }
    memcpy(estimates + k * bytes, &estimate.values, of_estimate);
    memcpy(estimates + k * bytes + of_estimate, contact.values, sizeof contact.values);
    memcpy(estimates + (k + 1) * bytes - sizeof load.values, load.values, sizeof load.values);
  }
  const size_t during = allocations - before;
  FILE *out = fopen(argv[3], "wb");
  if (out == NULL || fwrite(estimates, bytes, count, out) != count || fclose(out) != 0) {
    return 3;
  }
  printf("%zu samples, %zu allocations, %llu changes\n", count, during, (unsigned long long)estimate.payload_changes);
  tactid_snapshot_free(snapshot);
  tactid_identifier_free(identifier);
  return 0;
}
