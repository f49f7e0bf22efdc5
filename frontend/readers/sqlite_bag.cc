#include "frontend/readers/sqlite_bag.h"

#include <sqlite3.h>

#include <map>
#include <utility>
#include <vector>

#include "frontend/readers/decompress.h"
#include "frontend/readers/ros2_messages.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

struct SqliteDeleter {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, SqliteDeleter>;

std::string Text(sqlite3_stmt* statement, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
  return text == nullptr ? "" : text;
}

// Every frame of Zstandard begins so (RFC 8878, 3.1.1); CDR begins with a zero.
bool IsZstd(ByteView bytes) {
  return bytes.size >= 4 && bytes.data[0] == 0x28 && bytes.data[1] == 0xB5 &&
         bytes.data[2] == 0x2F && bytes.data[3] == 0xFD;
}

class SqliteBag : public Bag {
 public:
  explicit SqliteBag(const std::string& path) : path_(path) {}

  Status Open() {
    sqlite3* raw = nullptr;
    const int code =
        sqlite3_open_v2(path_.c_str(), &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
    database_.reset(raw);
    if (code != SQLITE_OK) return Failed();
    // As sqlite.org/security.html advises for databases of strangers.
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestRecord));
    sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    sqlite3_exec(raw, "PRAGMA cell_size_check = ON", nullptr, nullptr, nullptr);

    const Statement rows =
        Prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    if (rows == nullptr) return Failed();
    int step = 0;
    while ((step = sqlite3_step(rows.get())) == SQLITE_ROW) {
      std::string type_name = Text(rows.get(), 2);
      const std::string encoding = Text(rows.get(), 3);
      const bool is_ros2 = encoding == "cdr";
      const BagType type = is_ros2 ? BagTypeOf(type_name) : BagType::kOther;
      if (!is_ros2) type_name += ", encoded as " + encoding;
      index_[sqlite3_column_int64(rows.get(), 0)] = topics_.size();
      topics_.push_back({Text(rows.get(), 1), type_name, type});
    }
    return step == SQLITE_DONE ? Status() : Failed();
  }

  Status Select(const std::vector<bool>& wanted) override {
    std::string ids;
    for (const auto& [id, topic] : index_) {
      if (wanted[topic]) ids += Concat(ids.empty() ? "" : ",", id);
    }
    counts_.assign(topics_.size(), 0);
    rows_ = Prepare(
        Concat("SELECT topic_id, data FROM messages WHERE topic_id IN (", ids, ") ORDER BY id"));
    return rows_ == nullptr ? Failed() : Status();
  }

  Result<bool> Next(BagMessage* message) override {
    for (;;) {
      const int step = sqlite3_step(rows_.get());
      if (step == SQLITE_DONE) return false;
      if (step != SQLITE_ROW) return tl::unexpected(Failed().error());
      const auto topic = index_.find(sqlite3_column_int64(rows_.get(), 0));
      if (topic == index_.end()) continue;
      message->topic = topic->second;
      ++counts_[message->topic];
      const BagType type = topics_[message->topic].type;
      if (type == BagType::kOther) continue;
      const void* blob = sqlite3_column_blob(rows_.get(), 1);
      const auto size = static_cast<size_t>(sqlite3_column_bytes(rows_.get(), 1));
      const Status decoded = Decode(type, {static_cast<const uint8_t*>(blob), size}, message);
      if (decoded) return true;
      return BadInput(Concat(path_, ": ", topics_[message->topic].name, ", message ",
                             counts_[message->topic], ": ", decoded.error().message));
    }
  }

 private:
  Status Decode(BagType type, ByteView data, BagMessage* message) {
    if (IsZstd(data)) {
      Result<std::vector<uint8_t>> unpacked = DecompressZstd(data, kLargestRecord);
      if (!unpacked) return tl::unexpected(unpacked.error());
      unpacked_ = std::move(*unpacked);
      data = {unpacked_.data(), unpacked_.size()};
    }
    return DecodeRos2Message(type, data, message);
  }

  Statement Prepare(const std::string& query) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr);
    return Statement(statement);
  }

  Status Failed() const {
    return BadInput(Concat(path_, ": cannot be read as a bag of ROS 2 (SQLite: ",
                           sqlite3_errmsg(database_.get()), ")"));
  }

  const std::string path_;
  std::unique_ptr<sqlite3, SqliteDeleter> database_;
  std::map<int64_t, size_t> index_;  // of topics' ids into topics_
  std::vector<size_t> counts_;       // of messages taken, of each topic
  std::vector<uint8_t> unpacked_;
  Statement rows_;
};

}  // namespace

Result<std::unique_ptr<Bag>> OpenSqliteBag(const std::string& path) {
  auto bag = std::make_unique<SqliteBag>(path);
  if (Status open = bag->Open(); !open) return tl::unexpected(open.error());
  return bag;
}

}  // namespace camgyro
