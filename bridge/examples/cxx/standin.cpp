// Stands in for RAVEN's control process: replays a file of full states at 1 kHz over the bridge, once, never wrapped round.
//
// usage: standin FILE [--seconds S] [--core N] [--priority P] [--wait-readers N]
// The file is what `ravenpose convert RUN FILE.rvs` writes (docs/statefile.md). Prints one line when done: what was sent.
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <ravenpose.hpp>
#include <vector>

namespace {

volatile std::sig_atomic_t stop = 0;

struct Header {
  char magic[8];
  uint32_t version;
  uint32_t record_size;
  uint64_t count;
  int64_t period_ns;
  uint64_t hash;
  uint8_t zero[24];
};
static_assert(sizeof(Header) == 64, "header of a state file");

uint64_t fnv1a(const unsigned char *bytes, size_t size) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3u;
  return hash;
}

[[noreturn]] void refuse(const std::string &message) {
  std::fprintf(stderr, "standin: %s\n", message.c_str());
  std::exit(2);
}

std::vector<ravenpose_state> read_states(const std::string &path, int64_t &period_ns) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(path + ": cannot be read; make it with `ravenpose convert`");
  Header header{};
  file.read(reinterpret_cast<char *>(&header), sizeof header);
  if (!file || std::memcmp(header.magic, "RVNSTATE", 8) != 0) refuse(path + ": not a state file; make it with `ravenpose convert`");
  if (header.version != 1 || header.record_size != sizeof(ravenpose_state)) {
    refuse(path + ": a state file of another version; make it again with `ravenpose convert`");
  }
  if (header.count == 0 || header.count > 100000000u || header.period_ns <= 0) refuse(path + ": damaged header; make it again");
  file.seekg(0, std::ios::end);
  if (static_cast<uint64_t>(file.tellg()) != sizeof header + header.count * sizeof(ravenpose_state)) {
    refuse(path + ": truncated or too long; make it again with `ravenpose convert`");
  }
  file.seekg(sizeof header);
  std::vector<ravenpose_state> states(header.count);
  file.read(reinterpret_cast<char *>(states.data()), static_cast<std::streamsize>(states.size() * sizeof(ravenpose_state)));
  if (!file) refuse(path + ": cannot be read to its end");
  if (fnv1a(reinterpret_cast<const unsigned char *>(states.data()), states.size() * sizeof(ravenpose_state)) != header.hash) {
    refuse(path + ": damaged (its hash differs); make it again with `ravenpose convert`");
  }
  period_ns = header.period_ns;
  return states;
}

void add_ns(timespec &time, int64_t ns) {
  time.tv_nsec += ns % 1000000000;
  time.tv_sec += ns / 1000000000 + time.tv_nsec / 1000000000;
  time.tv_nsec %= 1000000000;
}

}  // namespace

int main(int argc, char **argv) try {
  std::string path;
  double seconds = 1e9;
  int core = -1, priority = 0;
  uint32_t wait_readers = 0;
  ravenpose::Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool has_value = i + 1 < argc;
    if (argument == "--seconds" && has_value) seconds = std::atof(argv[++i]);
    else if (argument == "--core" && has_value) core = std::atoi(argv[++i]);
    else if (argument == "--priority" && has_value) priority = std::atoi(argv[++i]);
    else if (argument == "--wait-readers" && has_value) wait_readers = static_cast<uint32_t>(std::atoi(argv[++i]));
    else if (argument.rfind("--", 0) == 0 || !path.empty()) refuse("unknown argument " + argument);
    else path = argument;
  }
  if (path.empty()) refuse("usage: standin FILE [--seconds S] [--core N] [--priority P] [--wait-readers N]");
  int64_t period_ns = 0;
  const auto states = read_states(path, period_ns);
  const auto wanted = static_cast<uint64_t>(seconds * 1e9 / static_cast<double>(period_ns));
  const uint64_t count = wanted < states.size() ? wanted : states.size();

  struct sigaction action {};
  action.sa_handler = [](int) { stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  ravenpose::Publisher publisher(options);
  for (int tries = 0; publisher.readers() < wait_readers && tries < 5000 && !stop; ++tries) {
    timespec pause{0, 1000000};
    nanosleep(&pause, nullptr);
  }
  // What a control process does for itself; without the rights it goes on as it is.
  mlockall(MCL_CURRENT | MCL_FUTURE);
  if (core >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(core, &set);
    if (sched_setaffinity(0, sizeof set, &set) != 0) std::fprintf(stderr, "standin: cannot be pinned to core %d\n", core);
  }
  if (priority > 0) {
    sched_param parameter{};
    parameter.sched_priority = priority;
    if (sched_setscheduler(0, SCHED_FIFO, &parameter) != 0) std::fprintf(stderr, "standin: no SCHED_FIFO here\n");
  }

  uint64_t sent = 0, failed = 0;
  timespec next{};
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (uint64_t i = 0; i < count && !stop; ++i) {
    if (ravenpose_state *place = publisher.loan()) {
      const uint64_t source = place->source_id;
      *place = states[i];
      place->source_id = source;
      place->sequence = i + 1;
      place->source_time_ns = 0;  // now, when it is sent
      if (publisher.send() == RAVENPOSE_OK) ++sent; else ++failed;
    } else {
      ++failed;
    }
    add_ns(next, period_ns);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
  }
  std::printf("sent %llu failed %llu\n", static_cast<unsigned long long>(sent), static_cast<unsigned long long>(failed));
  return failed == 0 ? 0 : 1;
} catch (const ravenpose::Error &error) {
  std::fprintf(stderr, "standin: %s\n", error.what());
  return 2;
}
