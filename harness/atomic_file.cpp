#include "harness/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* step, int error_number) {
  throw RunError(
      fmt::format("cannot write {}: {}: {}", path.string(), step, std::strerror(error_number)));
}

/// A file that vanishes unless it is renamed to its final name.
class TemporaryFile {
 public:
  /// O_EXCL lets two threads or processes that write the same picture never share a temporary file.
  explicit TemporaryFile(const std::filesystem::path& path) : path_(path) {
    for (int attempt = 0; file_ < 0; ++attempt) {
      name_ = fmt::format("{}.tmp-{}-{}", path.string(), ::getpid(), attempt);
      file_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (file_ < 0 && (errno != EEXIST || attempt >= 1000)) fail(path, "open", errno);
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (file_ >= 0) ::close(file_);
    if (!name_.empty()) ::unlink(name_.c_str());
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(path_, "write", errno);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  void publish() {
    if (::fsync(file_) != 0) fail(path_, "fsync", errno);
    const int file = std::exchange(file_, -1);
    if (::close(file) != 0) fail(path_, "close", errno);
    if (::rename(name_.c_str(), path_.c_str()) != 0) fail(path_, "rename", errno);
    name_.clear();
  }

 private:
  std::filesystem::path path_;
  std::string name_;
  int file_ = -1;
};

/// Makes the rename itself durable. Some file systems cannot sync a folder; the file's content is
/// safe without.
void sync_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

}  // namespace

void write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
  TemporaryFile file(path);
  file.write(bytes);
  file.publish();
  sync_folder(path);
}

}  // namespace penumbra
