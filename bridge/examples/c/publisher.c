/* Publishes a state at 1 kHz for as many milliseconds as asked: what RAVEN's control process does, at its smallest.
 * usage: publisher [MILLISECONDS] */
#define _POSIX_C_SOURCE 200809L
#include <ravenpose.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

int main(int argc, char **argv) {
  const long cycles = argc > 1 ? strtol(argv[1], NULL, 10) : 1000;
  char message[512] = "";
  ravenpose_options options = RAVENPOSE_OPTIONS_INIT;
  ravenpose_publisher *publisher = NULL;
  if (ravenpose_publisher_open(&options, &publisher, message, sizeof message) != RAVENPOSE_OK) {
    fprintf(stderr, "publisher: %s\n", message);
    return 2;
  }
  struct timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  long sent = 0;
  for (long cycle = 0; cycle < cycles; ++cycle) {
    ravenpose_state *state = NULL;
    if (ravenpose_publisher_loan(publisher, &state) == RAVENPOSE_OK) {
      /* Fill every field here; this example has one arm that stands at its home position. */
      state->type_[RAVENPOSE_GOLD] = 49;
      state->runlevel = 3;
      state->dt_nsec = 1000000;
      state->jpos[0] = state->jpos_d[0] = 30.0f;
      state->jpos[1] = state->jpos_d[1] = 90.0f;
      state->jpos[2] = state->jpos_d[2] = 22.918f; /* 0.4 m x 57.29578 */
      state->ori[0] = state->ori[4] = state->ori[8] = 1.0f;
      sent += ravenpose_publisher_send(publisher) == RAVENPOSE_OK;
    }
    next.tv_nsec += 1000000;
    if (next.tv_nsec >= 1000000000) {
      next.tv_nsec -= 1000000000;
      ++next.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }
  printf("sent %ld states, %u readers\n", sent, ravenpose_publisher_readers(publisher));
  ravenpose_publisher_close(&publisher);
  return sent == cycles ? 0 : 1;
}
