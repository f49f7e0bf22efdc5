#include "frontend/readers/mcap_bag.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/decompress.h"
#include "frontend/readers/ros2_messages.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr char kMagic[] = "\x89MCAP0\r\n";
constexpr uint64_t kMagicSize = 8;
constexpr uint64_t kRecordHeader = 1 + 8;  // opcode, length
constexpr uint64_t kFooterSize = 8 + 8 + 4;

enum Opcode : uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kDataEnd = 0x0F,
};

struct Record {
  uint8_t opcode = 0;
  ByteView content;
};

class McapBag : public Bag {
 public:
  explicit McapBag(const std::string& path) : path_(path), in_(path, std::ios::binary) {}

  Status Open() {
    in_.seekg(0, std::ios::end);
    size_ = static_cast<uint64_t>(std::max<std::streamoff>(in_.tellg(), 0));
    uint8_t magic[kMagicSize] = {};
    if (!Read(0, kMagicSize, magic) || std::memcmp(magic, kMagic, kMagicSize) != 0) {
      return BadInput(path_ + ": is no MCAP file of version 0");
    }
    if (ReadSummary()) return {};
    // Without a summary the channels are found only by reading all.
    channels_.clear();
    schemas_.clear();
    topics_.clear();
    Rewind(kMagicSize, size_);
    for (Record record;;) {
      const Result<bool> next = NextRecord(&record);
      if (!next) return tl::unexpected(next.error());
      if (!*next) return {};
      AddChannel(record);
    }
  }

  Status Select(const std::vector<bool>& wanted) override {
    wanted_ = wanted;
    counts_.assign(topics_.size(), 0);
    Rewind(kMagicSize, size_);
    return {};
  }

  Result<bool> Next(BagMessage* message) override {
    for (Record record;;) {
      const Result<bool> next = NextRecord(&record);
      if (!next || !*next) return next;
      if (record.opcode != kMessage) continue;
      ByteCursor cursor(record.content);
      const auto channel = channels_.find(cursor.U16());
      cursor.Skip(4 + 8 + 8);  // sequence, log_time, publish_time
      if (channel == channels_.end() || !wanted_[channel->second]) continue;
      message->topic = channel->second;
      const BagTopic& topic = topics_[message->topic];
      ++counts_[message->topic];
      if (topic.type == BagType::kOther) continue;
      const Status decoded = DecodeRos2Message(topic.type, cursor.Take(cursor.left()), message);
      if (decoded) return true;
      return BadInput(Concat(path_, ": ", topic.name, ", message ", counts_[message->topic], ": ",
                             decoded.error().message));
    }
  }

 private:
  tl::unexpected<Error> Damaged(const std::string& what) const {
    return BadInput(Concat(path_, ": at byte ", record_at_, ": ", what));
  }

  void Rewind(uint64_t begin, uint64_t end) {
    at_ = begin;
    end_ = end;
    chunk_.reset();
    notes_.clear();
  }

  // The channels from the summary at the file's end; false if there is none to rely on.
  bool ReadSummary() {
    const uint64_t tail = kRecordHeader + kFooterSize + kMagicSize;
    if (size_ < kMagicSize + tail) return false;
    Rewind(size_ - tail, size_);
    Record record;
    if (!NextRecord(&record).value_or(false) || record.opcode != kFooter) return false;
    const uint64_t summary = ByteCursor(record.content).U64();
    if (summary < kMagicSize || summary > size_ - tail) return false;
    Rewind(summary, size_ - tail);
    for (;;) {
      const Result<bool> next = NextRecord(&record);
      if (!next) return false;
      if (!*next) return !topics_.empty();
      AddChannel(record);
    }
  }

  void AddChannel(const Record& record) {
    if (record.opcode != kSchema && record.opcode != kChannel) return;
    ByteCursor cursor(record.content);
    const auto text = [&cursor] {
      const uint32_t size = cursor.U32();
      return cursor.Text(size);
    };
    const uint16_t id = cursor.U16();
    if (record.opcode == kSchema) {
      schemas_[id] = text();
      return;
    }
    std::string type_name = schemas_[cursor.U16()];
    const std::string topic = text();
    const std::string encoding = text();
    if (!cursor.good() || channels_.count(id) > 0) return;
    size_t index = 0;
    while (index < topics_.size() && topics_[index].name != topic) ++index;
    if (index == topics_.size()) {
      const bool is_ros2 = encoding == "cdr";
      const BagType type = is_ros2 ? BagTypeOf(type_name) : BagType::kOther;
      if (!is_ros2) type_name += ", encoded as " + encoding;
      topics_.push_back({topic, type_name, type});
    }
    channels_[id] = index;
  }

  // The next record, of a chunk or between them; false at the end of the data.
  Result<bool> NextRecord(Record* record) {
    for (;;) {
      if (chunk_ && chunk_->left() > 0) {
        record->opcode = chunk_->U8();
        const uint64_t length = chunk_->U64();
        record->content = chunk_->Take(length);
        if (!chunk_->good()) return Damaged("the chunk holds a record that is cut short");
        return true;
      }
      chunk_.reset();
      const Result<bool> next = NextOfFile(record);
      if (!next || !*next || record->opcode != kChunk) return next;
      if (Status chunk = OpenChunk(record->content); !chunk) return tl::unexpected(chunk.error());
    }
  }

  Result<bool> NextOfFile(Record* record) {
    record_at_ = at_;
    if (at_ == end_) return EndOfData();
    uint8_t header[kRecordHeader];
    if (end_ - at_ < kRecordHeader || !Read(at_, kRecordHeader, header)) return EndOfData();
    ByteCursor cursor({header, kRecordHeader});
    record->opcode = cursor.U8();
    const uint64_t length = cursor.U64();
    if (record->opcode == kDataEnd) return false;
    if (length > end_ - at_ - kRecordHeader) return EndOfData();
    const uint64_t content_at = at_ + kRecordHeader;
    at_ = content_at + length;
    record->content = {};
    if (record->opcode < kFooter || record->opcode > kChunk) return true;  // attachments, indices
    if (length > kLargestRecord) return Damaged(Concat("a record claims ", length, " bytes"));
    buffer_.resize(static_cast<size_t>(length));
    if (!Read(content_at, length, buffer_.data())) return Damaged("cannot be read");
    record->content = {buffer_.data(), buffer_.size()};
    return true;
  }

  // Files end with DataEnd and a footer, unless their writer was interrupted.
  bool EndOfData() {
    if (end_ == size_) {
      notes_ = {Concat(path_, ": ends within the record at byte ", record_at_, " of ", size_,
                       ": the recording was interrupted; what is before it is used")};
    }
    return false;
  }

  bool Read(uint64_t at, uint64_t size, uint8_t* to) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    in_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(size));
    return static_cast<bool>(in_);
  }

  Status OpenChunk(ByteView content) {
    ByteCursor cursor(content);
    cursor.Skip(8 + 8);  // message_start_time, message_end_time
    const uint64_t unpacked = cursor.U64();
    cursor.Skip(4);  // checksum
    const uint32_t name_size = cursor.U32();
    const std::string compression = cursor.Text(name_size);
    const uint64_t size = cursor.U64();
    const ByteView records = cursor.Take(size);
    if (!cursor.good()) return Damaged("the chunk is damaged");
    if (compression.empty()) {
      chunk_.emplace(records);
      return {};
    }
    if (unpacked > kLargestRecord) return Damaged(Concat("a chunk claims ", unpacked, " bytes"));
    if (compression != "lz4" && compression != "zstd") {
      return Damaged(Concat("the chunk's compression '", compression,
                            "' is not supported, expected lz4 or zstd"));
    }
    Result<std::vector<uint8_t>> bytes =
        compression == "lz4" ? DecompressLz4(records, unpacked) : DecompressZstd(records, unpacked);
    if (!bytes) return Damaged("the chunk " + bytes.error().message);
    unpacked_ = std::move(*bytes);
    chunk_.emplace(ByteView{unpacked_.data(), unpacked_.size()});
    return {};
  }

  const std::string path_;
  std::ifstream in_;
  uint64_t size_ = 0;                // of the file
  uint64_t at_ = 0, end_ = 0;        // of the next record, of what is read, in the file
  uint64_t record_at_ = 0;           // of the record that was read last
  std::vector<uint8_t> buffer_;      // its content
  std::vector<uint8_t> unpacked_;    // of the chunk
  std::optional<ByteCursor> chunk_;  // over buffer_ or unpacked_
  std::map<uint16_t, std::string> schemas_;
  std::map<uint16_t, size_t> channels_;  // index into topics_
  std::vector<bool> wanted_;             // of each topic
  std::vector<size_t> counts_;           // of messages taken, of each topic
};

}  // namespace

Result<std::unique_ptr<Bag>> OpenMcap(const std::string& path) {
  auto bag = std::make_unique<McapBag>(path);
  if (Status open = bag->Open(); !open) return tl::unexpected(open.error());
  return bag;
}

}  // namespace camgyro
