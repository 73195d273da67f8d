/* To be preloaded: the wall clock of the process jumps. Each 20.4 ms it is another one of right, an hour behind, right but ten per cent
 * fast, an hour and a leap second ahead. Everything else, CLOCK_MONOTONIC above all, is as the kernel says.
 * A second is 49 of these turns, 12 times round and one on: what is written once per second meets all four, one after the other. */
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { SECOND = 1000000000, TURN = SECOND / 49 };

static long long ns(const struct timespec *t) { return t->tv_sec * (long long)SECOND + t->tv_nsec; }

int clock_gettime(clockid_t clock, struct timespec *out) {
    const int answer = (int)syscall(SYS_clock_gettime, clock, out);
    if (answer != 0 || (clock != CLOCK_REALTIME && clock != CLOCK_REALTIME_COARSE && clock != CLOCK_TAI)) {
        return answer;
    }
    struct timespec monotonic;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &monotonic);
    const long long in_turn = ns(&monotonic) % TURN;
    long long wall = ns(out);
    switch (ns(&monotonic) / TURN % 4) {
    case 1:
        wall -= 3600LL * SECOND;
        break;
    case 2:
        wall += in_turn / 10;
        break;
    case 3:
        wall += 3601LL * SECOND;
        break;
    default:
        break;
    }
    out->tv_sec = wall / SECOND;
    out->tv_nsec = wall % SECOND;
    return 0;
}

int gettimeofday(struct timeval *restrict out, void *restrict zone) {
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    out->tv_sec = now.tv_sec;
    out->tv_usec = now.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *out) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out) {
        *out = now.tv_sec;
    }
    return now.tv_sec;
}
