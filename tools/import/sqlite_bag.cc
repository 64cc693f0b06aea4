// SPDX-License-Identifier: Apache-2.0
#include "tools/import/sqlite_bag.h"

#include <sqlite3.h>
#include <zstd.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxBlobBytes = (64 << 20) + (64 << 10);  // an image and the other fields of its message
constexpr int kMaxNameBytes = 1024;
constexpr std::string_view kZstdMagic = "\x28\xb5\x2f\xfd";
constexpr std::uint64_t kMaxZstdHeadBytes = 18;  // of a frame, with the size of its content
constexpr std::size_t kMaxTopics = 10'000;
// Steps of SQLite's machine, after each million of which it asks whether to go on. A row takes some ten.
constexpr int kStepsBetweenQuestions = 1'000'000, kMaxQuestionsOfRow = 3;
constexpr sqlite3_int64 kMaxHeapBytes = 256 << 20;

// `file:PATH` with other than plain characters escaped. Immutable: SQLite looks for no journal beside the
// file.
std::string address_of(const fs::path& path) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string address = "file:";
  for (const char c : fs::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '_' || c == '-') {
      address.push_back(c);
    } else {
      address.append({'%', kDigits[byte >> 4], kDigits[byte & 15]});
    }
  }
  return address + "?mode=ro&immutable=1";
}

// Messages that the recorder had not yet moved into the file.
void refuse_journal(const fs::path& path) {
  for (const char* suffix : {"-wal", "-journal"}) {
    const fs::path journal = path.string() + suffix;
    std::error_code absent;
    const std::uintmax_t bytes = fs::file_size(journal, absent);
    if (!absent && bytes > 0)
      throw InputError(path.string() + ": was not closed, " + journal.filename().string() +
                       " holds a part of it; 'sqlite3 FILE .tables' on a copy of both closes it");
  }
}

// Asked by SQLite; other answers than 0 stop it.
int count_question(void* questions) {
  return ++*static_cast<int*>(questions) > kMaxQuestionsOfRow ? 1 : 0;
}

}  // namespace

// A query with its rows, one at a time.
class SqliteBag::Statement {
 public:
  Statement(const SqliteBag& bag, const char* sql) : bag_(bag) {
    if (sqlite3_prepare_v2(bag.database_, sql, -1, &statement_, nullptr) != SQLITE_OK) refuse();
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  // The text is not copied.
  void bind(const std::string& text) {
    sqlite3_bind_text(statement_, 1, text.data(), static_cast<int>(text.size()), nullptr);
  }
  // False after the last row.
  [[nodiscard]] bool next() {
    int questions = 0;
    sqlite3_progress_handler(bag_.database_, kStepsBetweenQuestions, count_question, &questions);
    const int status = sqlite3_step(statement_);
    sqlite3_progress_handler(bag_.database_, 0, nullptr, nullptr);
    if (status != SQLITE_ROW && status != SQLITE_DONE) refuse();
    return status == SQLITE_ROW;
  }
  [[nodiscard]] std::int64_t integer(int column) const {
    if (sqlite3_column_type(statement_, column) != SQLITE_INTEGER) bag_.fail({}, kLayout);
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] std::string text(int column) const {
    if (sqlite3_column_type(statement_, column) != SQLITE_TEXT) bag_.fail({}, kLayout);
    const auto* const bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    const int length = sqlite3_column_bytes(statement_, column);
    if (bytes == nullptr || length > kMaxNameBytes) bag_.fail({}, "a name of more than 1024 bytes");
    return {bytes, static_cast<std::size_t>(length)};
  }

 private:
  static constexpr const char* kLayout =
      "expected the tables of a ROS 2 bag: topics (id, name, type, serialization_format) and messages (id, "
      "topic_id, timestamp, data)";
  [[noreturn]] void refuse() const {
    const int code = sqlite3_errcode(bag_.database_);
    const std::string why = sqlite3_errmsg(bag_.database_);
    bag_.SqliteBag::fail({}, code == SQLITE_ERROR ? std::string(kLayout) + " (" + why + ")"
                                                  : "a damaged database (" + why + ")");
  }

  const SqliteBag& bag_;
  sqlite3_stmt* statement_ = nullptr;
};

SqliteBag::SqliteBag(fs::path path) : path_(std::move(path)) {
  [[maybe_unused]] const ByteFile regular_file(path_);
  refuse_journal(path_);
  sqlite3_hard_heap_limit64(kMaxHeapBytes);
  const int status = sqlite3_open_v2(address_of(path_).c_str(), &database_,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  if (status != SQLITE_OK) {
    const std::string why = sqlite3_errstr(status);
    sqlite3_close_v2(database_);
    throw InputError(path_.string() + ": cannot be opened (" + why + ")");
  }
  limit_work();
}

SqliteBag::~SqliteBag() {
  sqlite3_blob_close(blob_);
  sqlite3_close_v2(database_);
}

// A schema is a program: it may have views, triggers and functions.
void SqliteBag::limit_work() {
  sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, kMaxBlobBytes);
  sqlite3_limit(database_, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_limit(database_, SQLITE_LIMIT_EXPR_DEPTH, 20);
  sqlite3_limit(database_, SQLITE_LIMIT_COLUMN, 100);
  for (const auto& [option, on] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                   {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                   {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                   {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                   {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0}})
    sqlite3_db_config(database_, option, on, static_cast<int*>(nullptr));
  sqlite3_exec(database_, "PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA temp_store=MEMORY", nullptr,
               nullptr, nullptr);
}

void SqliteBag::require_table(const std::string& name) {
  // Views and virtual tables have no page of their own.
  Statement tables(*this, "SELECT 1 FROM sqlite_schema WHERE name = ? AND type = 'table' AND rootpage > 0");
  tables.bind(name);
  if (!tables.next())
    fail({}, "no table '" + name + "', expected the tables 'topics' and 'messages' of a ROS 2 bag");
}

void SqliteBag::read_topics(const OnConnection& on_connection) {
  Statement topics(*this, "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  std::size_t count = 0;
  while (topics.next()) {
    if (++count > kMaxTopics) fail({}, "more than 10000 topics");
    BagConnection connection;
    const std::int64_t id = topics.integer(0);
    if (id < 0 || id > UINT32_MAX) fail({}, "a topic of id " + std::to_string(id));
    connection.id = static_cast<std::uint32_t>(id);
    connection.topic = topics.text(1);
    connection.type = without_msg(topics.text(2));
    const std::string encoding = topics.text(3);
    if (encoding != "cdr") connection.type = encoding + " " + connection.type;
    connection.packing = RosPacking::kCdr;
    on_connection(connection);
  }
}

void SqliteBag::read_messages(const OnMessage& on_message) {
  Statement rows(
      *this, "SELECT rowid, topic_id, timestamp, typeof(data), length(data) FROM messages ORDER BY rowid");
  while (rows.next()) {
    BagMessage message;
    const std::int64_t id = rows.integer(0), topic = rows.integer(1);
    if (id < 1 || topic < 0 || topic > UINT32_MAX) fail({}, "a message of id " + std::to_string(id));
    message.place.part = static_cast<std::uint64_t>(id);
    message.connection = static_cast<std::uint32_t>(topic);
    message.received_ns = rows.integer(2);
    if (message.received_ns < 0) fail(message.place, "a time before 1970");
    if (rows.text(3) != "blob") fail(message.place, "expected a blob as data");
    message.bytes =
        is_packed(message.place) ? content_bytes(message.place) : static_cast<std::uint64_t>(rows.integer(4));
    on_message(message);
  }
}

void SqliteBag::read_all(const OnConnection& on_connection, const OnMessage& on_message) {
  require_table("topics");
  require_table("messages");
  std::set<std::uint32_t> known;
  read_topics([&](const BagConnection& connection) {
    known.insert(connection.id);
    on_connection(connection);
  });
  read_messages([&](const BagMessage& message) {
    if (!known.contains(message.connection)) fail(message.place, "a message of an unknown topic");
    on_message(message);
  });
}

void SqliteBag::open_blob(const BagPlace& place) {
  if (place.part == blob_row_ && blob_ != nullptr) return;
  const auto row = static_cast<sqlite3_int64>(place.part);
  blob_row_ = 0;
  const int status = blob_ != nullptr
                         ? sqlite3_blob_reopen(blob_, row)
                         : sqlite3_blob_open(database_, "main", "messages", "data", row, 0, &blob_);
  if (status != SQLITE_OK) {
    const std::string why = sqlite3_errmsg(database_);
    sqlite3_blob_close(blob_);
    blob_ = nullptr;
    fail(place, "a damaged message (" + why + ")");
  }
  blob_row_ = place.part;
}

std::string SqliteBag::read(const BagPlace& place, std::uint64_t bytes) {
  if (!is_packed(place)) return read_blob(place, bytes);
  const std::string_view content = unpacked(place).view();
  if (place.offset > content.size() || bytes > content.size() - place.offset)
    fail(place, "cut off, expected " + std::to_string(bytes) + " bytes");
  return std::string(content.substr(place.offset, bytes));
}

bool SqliteBag::is_packed(const BagPlace& place) {
  open_blob(place);
  const auto size = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_));
  return size >= kZstdMagic.size() && read_blob({place.part, 0}, kZstdMagic.size()) == kZstdMagic;
}

// As the frame's head names it.
std::uint64_t SqliteBag::content_bytes(const BagPlace& place) {
  const auto size = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_));
  const std::string head = read_blob({place.part, 0}, std::min(size, kMaxZstdHeadBytes));
  const unsigned long long bytes = ZSTD_getFrameContentSize(head.data(), head.size());
  if (bytes == ZSTD_CONTENTSIZE_ERROR || bytes == ZSTD_CONTENTSIZE_UNKNOWN)
    fail(place, "a packed message (zstd) that does not name the size of its content");
  if (bytes > kMaxBlobBytes)
    fail(place, "a packed message of " + std::to_string(bytes) + " bytes, expected at most " +
                    std::to_string(kMaxBlobBytes));
  return bytes;
}

const Chunk& SqliteBag::unpacked(const BagPlace& place) {
  if (unpacked_row_ == place.part) return unpacked_;
  unpacked_row_ = 0;
  unpacked_ = {};
  const std::uint64_t bytes = content_bytes(place);
  const std::string packed =
      read_blob({place.part, 0}, static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_)));
  std::optional<Chunk> content = decompress(Compression::kZstd, packed, bytes);
  if (!content) fail(place, "a damaged message (zstd)");
  unpacked_ = std::move(*content);
  unpacked_row_ = place.part;
  return unpacked_;
}

std::string SqliteBag::read_blob(const BagPlace& place, std::uint64_t bytes) {
  open_blob(place);
  const auto size = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_));
  if (place.offset > size || bytes > size - place.offset)
    fail(place, "cut off, expected " + std::to_string(bytes) + " bytes");
  std::string content(bytes, '\0');
  if (sqlite3_blob_read(blob_, content.data(), static_cast<int>(bytes), static_cast<int>(place.offset)) !=
      SQLITE_OK)
    fail(place, std::string("a damaged message (") + sqlite3_errmsg(database_) + ")");
  return content;
}

void SqliteBag::fail(const BagPlace& place, const std::string& message) const {
  throw InputError(path_.string() + ": " +
                   (place.part == 0 ? "" : "message " + std::to_string(place.part) + ": ") + message);
}

}  // namespace farpoint::tools
