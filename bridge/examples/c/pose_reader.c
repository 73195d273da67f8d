/* Waits for poses and prints every hundredth. usage: pose_reader [MILLISECONDS] */
#include <ravenpose.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
  const int64_t end = ravenpose_now_ns() + 1000000 * (int64_t)(argc > 1 ? strtol(argv[1], NULL, 10) : 1000);
  char message[512] = "";
  ravenpose_options options = RAVENPOSE_OPTIONS_INIT;
  ravenpose_pose_reader *reader = NULL;
  if (ravenpose_pose_reader_open(&options, &reader, message, sizeof message) != RAVENPOSE_OK) {
    fprintf(stderr, "pose_reader: %s\n", message);
    return 2;
  }
  long count = 0;
  ravenpose_pose pose;
  while (ravenpose_now_ns() < end) {
    const int32_t code = ravenpose_pose_reader_wait(reader, 100000000, &pose);
    if (code < 0) {
      fprintf(stderr, "pose_reader: %s\n", ravenpose_error_text(code));
      ravenpose_pose_reader_close(&reader);
      return 1;
    }
    if (code == RAVENPOSE_NOTHING_NEW) continue;
    double um[3];
    /* The consumer rule: corrected if it may be used, else raw. */
    const int32_t which = ravenpose_position(&pose, RAVENPOSE_GOLD, ravenpose_now_ns(), um);
    if (count++ % 100 == 0 && which >= 0) {
      printf("state %llu: %9.1f %9.1f %9.1f um, %s, flags 0x%06x\n", (unsigned long long)pose.source_sequence, um[0], um[1], um[2],
             which == RAVENPOSE_OK ? "corrected" : "raw", pose.arm[RAVENPOSE_GOLD].flags);
    }
  }
  printf("%ld poses\n", count);
  ravenpose_pose_reader_close(&reader);
  return 0;
}
