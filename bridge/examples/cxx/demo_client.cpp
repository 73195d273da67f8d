// The client of `make demo`: takes every pose, checks each field against the replayed file, and prints what it saw.
//
// usage: demo_client FILE [--core N] [--truth TABLE.csv]
// TABLE.csv is a tidy table of the gold arm with truth_x_mm, truth_y_mm, truth_z_mm, a row per state: where the tip really was.
// Ends when the poses have been stale for half a second, or on SIGTERM. Exit status 1 if a message was lost without being counted,
// came out of order, or had a wrong field.
#include <sched.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <ravenpose.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace {

volatile std::sig_atomic_t stop = 0;

struct Arm {
  uint64_t poses = 0, valid = 0, fallback = 0, starting = 0;
  double sum2 = 0, largest = 0;  // of the correction, um
  uint32_t flags = 0;
};

double quantile(std::vector<int64_t> &values, double q) {
  if (values.empty()) return 0;
  const auto index = std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return static_cast<double>(values[index]) / 1000.0;
}

void row(const char *name, std::vector<int64_t> &values) {
  std::printf("  %-34s %9.1f %9.1f %9.1f %9.1f\n", name, quantile(values, 0.5), quantile(values, 0.99), quantile(values, 0.999),
              quantile(values, 1.0));
}

// The true tip: position in um and orientation as a unit quaternion w, x, y, z, in frame 0; NaN where the table has none.
struct Tip {
  std::array<double, 3> um{NAN, NAN, NAN};
  std::array<double, 4> wxyz{NAN, NAN, NAN, NAN};
};

// Row by row; empty if the table has no true positions.
std::vector<Tip> true_tips(const std::string &path) {
  const char *const names[7] = {"truth_x_mm", "truth_y_mm", "truth_z_mm", "truth_qw", "truth_qx", "truth_qy", "truth_qz"};
  std::ifstream file(path);
  std::vector<Tip> found;
  std::string line, cell;
  std::array<int, 7> column;
  column.fill(-1);
  bool header = false;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::stringstream cells(line);
    Tip tip;
    for (int index = 0; std::getline(cells, cell, ','); ++index) {
      for (size_t part = 0; part < 7; ++part) {
        if (!header && cell == names[part]) column[part] = index;
        if (!header || index != column[part] || cell.empty()) continue;
        const double value = std::strtod(cell.c_str(), nullptr);
        if (part < 3) tip.um[part] = value * 1000.0;
        else tip.wxyz[part - 3] = value;
      }
    }
    if (header) found.push_back(tip);
    header = true;
  }
  if (column[0] < 0 || column[1] < 0 || column[2] < 0) found.clear();
  return found;
}

double distance2(const double *position, const Tip &truth) {
  double sum = 0;
  for (size_t axis = 0; axis < 3; ++axis) sum += (position[axis] - truth.um[axis]) * (position[axis] - truth.um[axis]);
  return sum;
}

// Angle between a rotation matrix (row-major) and the true one, degrees.
double angle_deg(const float *matrix, const Tip &truth) {
  const auto [w, x, y, z] = truth.wxyz;
  const double there[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                           2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                           2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  // Half of the chord between the two: good for small angles, where the trace is not.
  double sum = 0;
  for (int i = 0; i < 9; ++i) sum += (matrix[i] - there[i]) * (matrix[i] - there[i]);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(sum / 8.0))) * 57.29577951308232;
}

// Does the pose carry what the file says for this state?
bool right(const ravenpose_pose &pose, const ravenpose_state &state) {
  for (uint32_t arm = 0; arm < 2; ++arm) {
    const ravenpose_arm_pose &out = pose.arm[arm];
    if (out.status == RAVENPOSE_STATUS_ABSENT) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (out.raw_position_um[axis] != state.pos[3 * arm + axis]) return false;
      if (out.corrected_position_um[axis] != out.raw_position_um[axis] + out.correction_um[axis]) return false;
      if (out.status != RAVENPOSE_STATUS_VALID && out.correction_um[axis] != 0.0) return false;
    }
    if (std::memcmp(out.orientation, &state.ori[9 * arm], sizeof out.orientation) != 0) return false;
    const bool may_turn = out.status == RAVENPOSE_STATUS_VALID && out.orientation_model_id != 0;
    if (!may_turn && std::memcmp(out.corrected_orientation, out.orientation, sizeof out.orientation) != 0) return false;
  }
  return pose.runlevel == state.runlevel;
}

}  // namespace

int main(int argc, char **argv) try {
  std::string path, truth_path;
  int core = -1;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--core" && i + 1 < argc) core = std::atoi(argv[++i]);
    else if (std::string(argv[i]) == "--truth" && i + 1 < argc) truth_path = argv[++i];
    else path = argv[i];
  }
  std::ifstream file(path, std::ios::binary);
  std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (bytes.size() < 64 || std::memcmp(bytes.data(), "RVNSTATE", 8) != 0) {
    std::fprintf(stderr, "demo_client: %s: not a state file; make it with `ravenpose convert`\n", path.c_str());
    return 2;
  }
  std::vector<ravenpose_state> states((bytes.size() - 64) / sizeof(ravenpose_state));
  std::memcpy(states.data(), bytes.data() + 64, states.size() * sizeof(ravenpose_state));

  std::vector<Tip> truth;
  if (!truth_path.empty() && (truth = true_tips(truth_path)).empty()) {
    std::fprintf(stderr, "demo_client: %s: no truth_x_mm, truth_y_mm, truth_z_mm in it\n", truth_path.c_str());
    return 2;
  }
  double raw_sum2 = 0, corrected_sum2 = 0, raw_largest2 = 0;
  double raw_angle2 = 0, corrected_angle2 = 0;
  uint64_t compared = 0, angles = 0;

  struct sigaction action {};
  action.sa_handler = [](int) { stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  if (core >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(core, &set);
    sched_setaffinity(0, sizeof set, &set);
  }

  ravenpose::Options options;
  options.queue_depth = 64;
  ravenpose::PoseReader reader(options);
  // Whoever plays the states waits for this.
  std::printf("connected\n");
  std::fflush(stdout);
  mlockall(MCL_CURRENT | MCL_FUTURE);
  std::vector<int64_t> to_service, in_service, to_client, whole;
  for (auto *values : {&to_service, &in_service, &to_client, &whole}) values->reserve(states.size());

  Arm arms[2];
  uint64_t received = 0, answered = 0, wrong = 0, reordered = 0, overflowed = 0, last_sequence = 0, last_source = 0;
  uint64_t stale = 0;
  ravenpose_pose last{};
  int64_t quiet_since = ravenpose_now_ns();
  while (!stop) {
    const auto pose = reader.next();
    if (!pose) {
      if (reader.code() < 0) {
        std::fprintf(stderr, "demo_client: %s\n", ravenpose_error_text(reader.code()));
        return 1;
      }
      timespec pause{0, 50000};
      nanosleep(&pause, nullptr);
      if (answered > 0 && ravenpose_now_ns() - quiet_since > 500000000) break;
      continue;
    }
    const int64_t now = ravenpose_now_ns();
    ++received;
    if (last_sequence != 0 && pose->sequence <= last_sequence) ++reordered;
    else if (last_sequence != 0) overflowed += pose->sequence - last_sequence - 1;
    last_sequence = pose->sequence;
    if (pose->source_sequence < last_source) ++reordered;
    const bool repeats = pose->source_sequence == last_source;
    last_source = pose->source_sequence;
    last = *pose;
    if (pose->source_sequence == 0 || pose->source_sequence > states.size() || !right(*pose, states[pose->source_sequence - 1])) {
      if (++wrong == 1) std::fprintf(stderr, "demo_client: wrong field in the pose of state %llu\n", (unsigned long long)last_source);
    }
    if (repeats) {
      ++stale;
      continue;
    }
    quiet_since = now;
    ++answered;
    to_service.push_back(pose->start_time_ns - pose->source_time_ns);
    in_service.push_back(pose->publish_time_ns - pose->start_time_ns);
    to_client.push_back(now - pose->publish_time_ns);
    whole.push_back(pose->publish_time_ns - pose->source_time_ns);
    const ravenpose_arm_pose &gold = pose->arm[0];
    if (gold.status == RAVENPOSE_STATUS_VALID && last_source <= truth.size() && std::isfinite(truth[last_source - 1].um[0])) {
      const Tip &tip = truth[last_source - 1];
      const double raw2 = distance2(gold.raw_position_um, tip);
      raw_sum2 += raw2;
      raw_largest2 = std::max(raw_largest2, raw2);
      corrected_sum2 += distance2(gold.corrected_position_um, tip);
      ++compared;
      if (gold.orientation_model_id != 0 && std::isfinite(tip.wxyz[0])) {
        raw_angle2 += std::pow(angle_deg(gold.orientation, tip), 2);
        corrected_angle2 += std::pow(angle_deg(gold.corrected_orientation, tip), 2);
        ++angles;
      }
    }
    for (uint32_t arm = 0; arm < 2; ++arm) {
      const ravenpose_arm_pose &out = pose->arm[arm];
      if (out.status == RAVENPOSE_STATUS_ABSENT) continue;
      Arm &sum = arms[arm];
      ++sum.poses;
      sum.flags |= out.flags;
      if (out.status == RAVENPOSE_STATUS_VALID) ++sum.valid;
      else if (out.status == RAVENPOSE_STATUS_FALLBACK) ++sum.fallback;
      else ++sum.starting;
      double norm2 = 0;
      for (double value : out.correction_um) norm2 += value * value;
      sum.sum2 += norm2;
      sum.largest = std::max(sum.largest, std::sqrt(norm2));
    }
  }

  const uint64_t unaccounted = last_source - answered - last.skipped - last.lost;
  std::printf("  states answered %llu of %llu; overtaken by a newer one (counted) %llu, lost before the service (counted) %llu\n",
              (unsigned long long)answered, (unsigned long long)last_source, (unsigned long long)last.skipped,
              (unsigned long long)last.lost);
  std::printf("  poses received %llu (%llu of them repeat the last state as stale), not accounted for %llu, missed by this client %llu, "
              "reordered %llu, wrong fields %llu\n\n",
              (unsigned long long)received, (unsigned long long)stale, (unsigned long long)unaccounted, (unsigned long long)overflowed,
              (unsigned long long)reordered, (unsigned long long)wrong);
  std::printf("  %-34s %9s %9s %9s %9s\n", "latency, us", "p50", "p99", "p99.9", "max");
  row("state sent -> service takes it", to_service);
  row("service takes it -> pose sent", in_service);
  row("state sent -> pose sent", whole);
  row("pose sent -> client reads (sleeping)", to_client);
  std::printf("\n  %-6s %8s %8s %9s %9s   %s\n", "arm", "poses", "valid", "starting", "fallback", "corrected minus raw: RMS, largest");
  for (uint32_t arm = 0; arm < 2; ++arm) {
    const Arm &sum = arms[arm];
    if (sum.poses == 0) continue;
    std::printf("  %-6s %8llu %8llu %9llu %9llu   %.3f mm, %.3f mm\n", arm == 0 ? "gold" : "green", (unsigned long long)sum.poses,
                (unsigned long long)sum.valid, (unsigned long long)sum.starting, (unsigned long long)sum.fallback,
                std::sqrt(sum.sum2 / static_cast<double>(sum.poses)) / 1000.0, sum.largest / 1000.0);
    const ravenpose_arm_pose &out = last.arm[arm];
    std::printf("         last: raw %.1f %.1f %.1f um, corrected %.1f %.1f %.1f um\n", out.raw_position_um[0], out.raw_position_um[1],
                out.raw_position_um[2], out.corrected_position_um[0], out.corrected_position_um[1], out.corrected_position_um[2]);
  }
  if (compared > 0) {
    const double n = static_cast<double>(compared);
    std::printf("  gold arm against its true tip, %llu valid poses: raw off by %.3f mm RMS, %.3f mm at most; corrected off by %.3f mm RMS\n",
                (unsigned long long)compared, std::sqrt(raw_sum2 / n) / 1000.0, std::sqrt(raw_largest2) / 1000.0,
                std::sqrt(corrected_sum2 / n) / 1000.0);
    if (angles > 0) {
      const double m = static_cast<double>(angles);
      std::printf("  and its orientation: raw off by %.2f deg RMS; corrected off by %.2f deg RMS\n", std::sqrt(raw_angle2 / m),
                  std::sqrt(corrected_angle2 / m));
    }
  } else if (!truth.empty()) {
    std::printf("  gold arm against its true tip: no valid pose to compare\n");
  }
  if (answered == 0) std::fprintf(stderr, "demo_client: no pose came\n");
  return answered == 0 || unaccounted != 0 || overflowed != 0 || reordered != 0 || wrong != 0 ? 1 : 0;
} catch (const ravenpose::Error &error) {
  std::fprintf(stderr, "demo_client: %s\n", error.what());
  return 2;
}
