#include "softarm/base/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace softarm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = 64 * 1024;

/// The file behind symbolic links, those too that lead to nothing yet.
fs::path behind_links(fs::path file) {
  constexpr int kMostLinks = 40;  // as the kernel
  std::error_code error;
  for (int k = 0; k < kMostLinks && fs::is_symlink(file, error); ++k)
    file = file.parent_path() / fs::read_symlink(file, error);
  return file;
}

/// Bytes written of `text`; errno says why not all.
std::size_t write_some(int descriptor, std::string_view text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = ::write(descriptor, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

}  // namespace

void refuse_input(const fs::path& output, std::span<const fs::path> inputs) {
  struct stat out {};
  if (stat(output.c_str(), &out) != 0 || !S_ISREG(out.st_mode)) return;
  for (const fs::path& input : inputs) {
    struct stat in {};
    if (stat(input.c_str(), &in) == 0 && in.st_dev == out.st_dev && in.st_ino == out.st_ino)
      throw OutputIsInput(fmt::format(
          "{}: expected a file that is not read, got {}: writing would destroy the "
          "input; choose another name for the output",
          output.string(), input == output ? "one of the inputs" : "the input " + input.string()));
  }
}

OutputFile::OutputFile(const fs::path& file, std::span<const fs::path> inputs, Kind kind)
    : file_(behind_links(file)), kind_(kind) {
  std::error_code error;
  const auto status = fs::status(file, error);
  const bool same = fs::equivalent(file, file_, error);
  // What /proc and /dev call a file has no place beside it.
  regular_ = !fs::exists(status) || (fs::is_regular_file(status) && same && !error);
  if (!regular_) file_ = file;
  partial_ = regular_ ? fs::path(file_.string() + ".partial") : file_;
  refuse_input(file_, inputs);
  refuse_input(partial_, inputs);
  const fs::path folder = regular_ ? fs::path(".") / file_.parent_path() : file_;
  const bool replaceable = !fs::exists(status) || access(file_.c_str(), W_OK) == 0;
  if (!replaceable || access(folder.c_str(), W_OK) != 0) refuse(std::strerror(errno));
  if (kind_ == Kind::record) open();
}

void OutputFile::refuse(const std::string& why) {
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = -1;
  throw OutputError(fmt::format("cannot write {}: {}; choose another name", file_.string(), why));
}

void OutputFile::open() {
  if (!regular_) {
    descriptor_ = ::open(file_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
    if (descriptor_ < 0) refuse(std::strerror(errno));
    return;
  }
  // What an ended program left behind is replaced; what a running one writes is locked.
  if (const int left = ::open(partial_.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC); left >= 0) {
    const bool busy = flock(left, LOCK_EX | LOCK_NB) != 0;
    close(left);
    if (busy) refuse("another program is writing it");
  }
  unlink(partial_.c_str());
  descriptor_ =
      ::open(partial_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (descriptor_ < 0) refuse(std::strerror(errno));
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) refuse("another program is writing it");
  struct stat before {};
  if (stat(file_.c_str(), &before) == 0 && fchmod(descriptor_, before.st_mode & 07777) != 0)
    refuse(std::strerror(errno));
}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  if (kind_ == Kind::record) {
    try {
      commit();
    } catch (const OutputError&) {  // who wants to know calls commit()
    }
  } else {
    if (regular_) unlink(partial_.c_str());
    close(descriptor_);
  }
}

void OutputFile::reserve(std::size_t bytes) {
  if (descriptor_ < 0) open();
  if (regular_) fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes));
}

void OutputFile::fail(int error) const {
  throw OutputError(fmt::format("could not write all of {}: {}{}", file_.string(),
                                std::strerror(error),
                                error == ENOSPC ? "; is the disk full?" : ""));
}

void OutputFile::write(std::string_view record) {
  if (error_ != 0) fail(error_);
  if (descriptor_ < 0) open();
  buffer_ += record;
  ends_.push_back(buffer_.size());
  if (buffer_.size() >= kBuffer) flush();
}

void OutputFile::flush() {
  if (error_ != 0) fail(error_);
  errno = 0;
  const std::size_t written = write_some(descriptor_, buffer_);
  if (written < buffer_.size()) {
    error_ = errno != 0 ? errno : EIO;
    keep_whole_records(written);
    fail(error_);
  }
  size_ += written;
  buffer_.clear();
  ends_.clear();
}

void OutputFile::keep_whole_records(std::size_t written) noexcept {
  std::size_t whole = 0;
  for (const std::size_t end : ends_)
    if (end <= written) whole = end;
  size_ += whole;
  buffer_.clear();
  ends_.clear();
}

void OutputFile::put_in_place() noexcept {
  if (regular_) {
    // Cuts what is not a whole record, and frees what was reserved.
    const bool cut = ftruncate(descriptor_, static_cast<off_t>(size_)) == 0;
    if (kind_ == Kind::document && fsync(descriptor_) != 0 && error_ == 0) error_ = errno;
    if (!cut && error_ == 0) error_ = errno;
    if (error_ != 0 && kind_ == Kind::document) {
      unlink(partial_.c_str());
    } else if (rename(partial_.c_str(), file_.c_str()) != 0 && error_ == 0) {
      error_ = errno;
    }
  }
  if (close(descriptor_) != 0 && error_ == 0) error_ = errno;
  descriptor_ = -1;
}

void OutputFile::commit() {
  if (descriptor_ >= 0) {
    try {
      if (error_ == 0) flush();
    } catch (const OutputError&) {  // as error_ reports below
    }
    put_in_place();
  }
  if (error_ != 0) fail(error_);
}

void write_text(const fs::path& path, std::string_view text, std::span<const fs::path> inputs) {
  OutputFile file(path, inputs);
  file.write(text);
  file.commit();
}

}  // namespace softarm
