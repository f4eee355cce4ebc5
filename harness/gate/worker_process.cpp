#include "harness/gate/worker_process.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/process.hpp>
#include <chrono>

#include "harness/exit_codes.h"
#include "scenes/core/error.h"

namespace penumbra {

namespace asio = boost::asio;
namespace process = boost::process;

namespace {

std::vector<std::string> arguments_of(const WorkerOptions& options) {
  std::vector<std::string> arguments{"measure", options.config.string()};
  for (const std::string& text : options.overrides) {
    arguments.emplace_back("--set");
    arguments.push_back(text);
  }
  return arguments;
}

process::environment environment_of(const WorkerOptions& options) {
  process::environment environment = boost::this_process::environment();
  environment["PENUMBRA_LAYOUT"] = std::string(static_cast<std::size_t>(options.padding), 'x');
  return environment;
}

}  // namespace

/// The process with one pipe to it and one from it.
class WorkerProcess::Pipes {
 public:
  explicit Pipes(const WorkerOptions& options)
      : name_(options.executable.string()),
        timeout_(options.timeout_s),
        to_(io_),
        from_(io_),
        child_(name_, process::args(arguments_of(options)),
               process::std_in<to_, process::std_out> from_, environment_of(options)) {}

  ~Pipes() {
    std::error_code ignored;
    child_.terminate(ignored);
    child_.wait(ignored);
  }
  Pipes(const Pipes&) = delete;
  Pipes& operator=(const Pipes&) = delete;

  void send(const std::string& line) {
    boost::system::error_code error;
    asio::write(to_, asio::buffer(line), error);
    if (error) throw WorkerFailure(ending());
  }

  std::string receive() {
    std::optional<boost::system::error_code> done;
    asio::async_read_until(
        from_, asio::dynamic_buffer(buffer_), '\n',
        [&](const boost::system::error_code& error, std::size_t) { done = error; });
    io_.restart();
    io_.run_for(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(timeout_)));
    if (!done) {
      // The handler refers to this frame, so that it has to be done with before the throw.
      from_.cancel();
      io_.run();
      throw WorkerFailure(fmt::format("{}: no answer within {} s", name_, timeout_));
    }
    if (*done) throw WorkerFailure(ending());
    const std::size_t end = buffer_.find('\n');
    std::string line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    return line;
  }

  /// Of a process that ended by itself, as wait(2) has it; empty while it lives.
  std::optional<int> status() const { return status_; }

 private:
  std::string ending() {
    child_.wait();
    status_ = child_.native_exit_code();
    const int status = *status_;
    if (WIFSIGNALED(status)) {
      return fmt::format("{}: ended by signal {}", name_, WTERMSIG(status));
    }
    return fmt::format("{}: ended with exit code {}; what it said is above", name_,
                       WEXITSTATUS(status));
  }

  std::string name_;
  double timeout_;
  asio::io_context io_;
  process::async_pipe to_, from_;
  process::child child_;
  std::optional<int> status_;
  std::string buffer_;
};

WorkerProcess::WorkerProcess(const WorkerOptions& options) {
  try {
    pipes_ = std::make_unique<Pipes>(options);
  } catch (const process::process_error& e) {
    throw InputError(
        fmt::format("{}: cannot be started: {}", options.executable.string(), e.code().message()));
  }
  try {
    greeting_ = read_greeting(pipes_->receive());
  } catch (const ReferenceError& e) {
    throw ReferenceError(fmt::format("{}: {}", options.executable.string(), e.what()));
  } catch (const WorkerFailure&) {
    const std::optional<int> status = pipes_->status();
    if (status && WIFEXITED(*status) && WEXITSTATUS(*status) == kInputFault) {
      throw InputError(fmt::format(
          "{}: refuses {} (see above), or is of a version without the command \"measure\"",
          options.executable.string(), options.config.string()));
    }
    throw;
  } catch (const RunError& e) {
    throw WorkerFailure(fmt::format("{}: {}", options.executable.string(), e.what()));
  }
}

WorkerProcess::~WorkerProcess() = default;

WorkerReply WorkerProcess::measure(const WorkerRequest& request) {
  pipes_->send(to_line(request));
  try {
    return read_reply(pipes_->receive());
  } catch (const RunError& e) {
    throw WorkerFailure(e.what());
  }
}

}  // namespace penumbra
