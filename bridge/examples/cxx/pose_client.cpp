// The C++ client: prints the corrected position of each connected arm ten times a second. usage: pose_client [MILLISECONDS]
#include <cstdio>
#include <cstdlib>
#include <ravenpose.hpp>

int main(int argc, char **argv) try {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(argc > 1 ? std::atol(argv[1]) : 1000);
  ravenpose::PoseReader reader;
  long count = 0;
  while (std::chrono::steady_clock::now() < end) {
    const auto pose = reader.wait(100ms);
    if (!pose || count++ % 100 != 0) continue;
    for (uint32_t arm = 0; arm < ravenpose_arms(); ++arm) {
      if (pose->arm[arm].status == RAVENPOSE_STATUS_ABSENT) continue;
      if (const auto at = ravenpose::position(*pose, arm, ravenpose_now_ns())) {
        std::printf("%s %10.1f %10.1f %10.1f um %s\n", arm == RAVENPOSE_GOLD ? "gold " : "green", at->um[0], at->um[1], at->um[2],
                    at->corrected ? "corrected" : "raw");
      }
    }
  }
  std::printf("%ld poses\n", count);
  return 0;
} catch (const ravenpose::Error &error) {
  std::fprintf(stderr, "pose_client: %s\n", error.what());
  return 2;
}
