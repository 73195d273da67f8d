// ravenpose for C++17: handles that close themselves, errors as exceptions at open and as values afterwards.
// Research software, no clinical use.
#ifndef RAVENPOSE_HPP
#define RAVENPOSE_HPP

#include <ravenpose.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

namespace ravenpose {

// Thrown by the constructors; what() is one line with the remedy.
class Error : public std::runtime_error {
 public:
  Error(int32_t code, const std::string &message) : std::runtime_error(message), code_(code) {}
  int32_t code() const noexcept { return code_; }

 private:
  int32_t code_;
};

struct Options {
  std::string prefix;        // empty: RAVENPOSE_PREFIX, else iox2_
  std::string root;          // empty: RAVENPOSE_ROOT, else /tmp/iceoryx2/
  uint32_t queue_depth = 1;  // readers: messages kept while nobody takes them, 1 to 256
};

namespace detail {

template <typename Handle, typename Open>
Handle *open(const Options &options, Open &&call) {
  ravenpose_options c = RAVENPOSE_OPTIONS_INIT;
  c.prefix = options.prefix.empty() ? nullptr : options.prefix.c_str();
  c.root = options.root.empty() ? nullptr : options.root.c_str();
  c.queue_depth = options.queue_depth;
  Handle *handle = nullptr;
  char message[512] = "";
  const int32_t code = call(&c, &handle, message, sizeof message);
  if (code != RAVENPOSE_OK) {
    throw Error(code, message[0] != '\0' ? message : ravenpose_error_text(code));
  }
  return handle;
}

struct Close {
  void operator()(ravenpose_publisher *handle) const noexcept { ravenpose_publisher_close(&handle); }
  void operator()(ravenpose_pose_reader *handle) const noexcept { ravenpose_pose_reader_close(&handle); }
};

}  // namespace detail

// The one publisher of states. After construction no call allocates, locks, blocks or throws.
class Publisher {
 public:
  explicit Publisher(const Options &options = {})
      : handle_(detail::open<ravenpose_publisher>(options, ravenpose_publisher_open)) {}

  // A place in shared memory for the next state, or null (then the cycle goes on without publishing).
  ravenpose_state *loan() noexcept {
    ravenpose_state *state = nullptr;
    return ravenpose_publisher_loan(handle_.get(), &state) == RAVENPOSE_OK ? state : nullptr;
  }
  int32_t send() noexcept { return ravenpose_publisher_send(handle_.get()); }
  int32_t publish(const ravenpose_state &state) noexcept { return ravenpose_publisher_publish(handle_.get(), &state); }
  uint32_t readers() const noexcept { return ravenpose_publisher_readers(handle_.get()); }

 private:
  std::unique_ptr<ravenpose_publisher, detail::Close> handle_;
};

// The position of one arm by the consumer rule.
struct Position {
  std::array<double, 3> um;  // frame 0 of the arm
  bool corrected;            // false: this is the raw position
};

// The rotation of one arm by the consumer rule.
struct Orientation {
  std::array<float, 9> matrix;  // row-major, frame 0 of the arm
  bool corrected;               // false: this is RAVEN's own
};

class PoseReader {
 public:
  explicit PoseReader(const Options &options = {})
      : handle_(detail::open<ravenpose_pose_reader>(options, ravenpose_pose_reader_open)) {}

  // The newest pose that was not taken yet.
  std::optional<ravenpose_pose> take() noexcept { return got(ravenpose_pose_reader_take(handle_.get(), &pose_)); }
  // The oldest pose that still waits (for recorders).
  std::optional<ravenpose_pose> next() noexcept { return got(ravenpose_pose_reader_next(handle_.get(), &pose_)); }
  // Sleeps until a pose comes, at most the timeout.
  std::optional<ravenpose_pose> wait(std::chrono::nanoseconds timeout) noexcept {
    return got(ravenpose_pose_reader_wait(handle_.get(), timeout.count(), &pose_));
  }
  // The last call's code: negative after a failure.
  int32_t code() const noexcept { return code_; }

 private:
  std::optional<ravenpose_pose> got(int32_t code) noexcept {
    code_ = code;
    if (code == RAVENPOSE_OK) return pose_;
    return std::nullopt;
  }
  std::unique_ptr<ravenpose_pose_reader, detail::Close> handle_;
  ravenpose_pose pose_{};
  int32_t code_ = RAVENPOSE_NOTHING_NEW;
};

namespace detail {
// What a rule gave with this code.
template <class Result>
std::optional<Result> ruled(int32_t code, Result result) noexcept {
  if (code < 0) return std::nullopt;
  result.corrected = code == RAVENPOSE_OK;
  return result;
}
}  // namespace detail

inline std::optional<Position> position(const ravenpose_pose &pose, uint32_t arm, int64_t now_ns) noexcept {
  Position result{};
  const int32_t code = ravenpose_position(&pose, arm, now_ns, result.um.data());
  return detail::ruled(code, result);
}

inline std::optional<Orientation> orientation(const ravenpose_pose &pose, uint32_t arm, int64_t now_ns) noexcept {
  Orientation result{};
  const int32_t code = ravenpose_orientation(&pose, arm, now_ns, result.matrix.data());
  return detail::ruled(code, result);
}

}  // namespace ravenpose

#endif  // RAVENPOSE_HPP
