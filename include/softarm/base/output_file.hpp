// A file that a program writes: never over one that it reads, never half a file under a good name.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace softarm {

/// An output would replace an input.
struct OutputIsInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An output could not be written: a full disk, no permission.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Files by name.
using Files = std::vector<std::filesystem::path>;

/// Writes NAME.partial and renames it to NAME at the end; through a symbolic link, beside the file
/// that it names. What is not a regular file (/dev/stdout, a pipe) is written as it is.
class OutputFile {
 public:
  /// What becomes of it without commit().
  enum class Kind {
    document,  ///< whole or not at all: without commit() the file stays as it was, or is not there
    record     ///< grows while something runs: what was written by then is always kept
  };

  /// @param inputs  files that are read: none of them may be replaced, under whatever name
  /// @throws OutputIsInput, OutputError if the file cannot be made or is being written by
  /// another program
  OutputFile(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs,
             Kind kind = Kind::document);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Claims space on the disk, where the file system can, so that this much can be written later.
  void reserve(std::size_t bytes);

  /// Appends. Where a record cannot be written (a full disk), the file keeps all whole ones before.
  /// @throws OutputError if something could not be written, now or before
  void write(std::string_view record);

  /// Puts the file in its place. @throws OutputError as write does
  void commit();

  /// Where the text is until commit(), after flush().
  const std::filesystem::path& partial() const { return partial_; }
  /// @throws OutputError as write does
  void flush();

 private:
  void open();
  [[noreturn]] void refuse(const std::string& why);
  void keep_whole_records(std::size_t written) noexcept;
  void put_in_place() noexcept;
  [[noreturn]] void fail(int error) const;

  std::filesystem::path file_, partial_;
  Kind kind_;
  bool regular_ = true;            ///< written as partial_ and renamed
  int descriptor_ = -1;            ///< of a document: once something was written
  int error_ = 0;                  ///< errno of the first failure
  std::size_t size_ = 0;           ///< bytes on the disk
  std::string buffer_;             ///< what follows them
  std::vector<std::size_t> ends_;  ///< of the records in the buffer
};

/// Refuses to replace an input: the same file by device and number, whatever its name.
/// @throws OutputIsInput
void refuse_input(const std::filesystem::path& output,
                  std::span<const std::filesystem::path> inputs);

/// Writes a text file. @throws as OutputFile
void write_text(const std::filesystem::path& path, std::string_view text,
                std::span<const std::filesystem::path> inputs);

}  // namespace softarm
