// A peer with eProsima Fast DDS, the library of ROS 2's default middleware, that sends and shows bare bytes of CDR.
//
// usage: fast_dds DOMAIN [LEASE_S], then a line a command on standard input:
//   read TOPIC TYPE RELIABILITY DURABILITY DEPTH    shows each sample as `sample TOPIC HEX`
//   hold TOPIC TYPE RELIABILITY DURABILITY DEPTH    is matched, and never takes a sample
//   write TOPIC TYPE RELIABILITY DURABILITY DEPTH   a writer
//   send TOPIC HEX                                  a sample by it
// A depth of 0 keeps all, and refuses what is beyond the first sixteen samples not yet taken.
// With `reliable` or `best_effort`, and `volatile` or `transient_local`. How many peers a reader or writer has is shown as
// `matched TOPIC COUNT` when it changes; `ready TOPIC` answers the first three. The end of the input ends the peer.
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<unsigned char>;

namespace {

constexpr int most_unseen = 16;       // samples that a depth of 0 keeps; then it takes in no more
constexpr unsigned most_bytes = 65536; // of a sample; memory is taken as samples need it

[[noreturn]] void fail(const std::string& what) {
    std::cerr << what << std::endl;
    std::exit(1);
}

// Two threads of the library and the main one write.
void say(const std::string& line) {
    static std::mutex one_at_a_time;
    std::lock_guard<std::mutex> lock(one_at_a_time);
    std::fwrite(line.data(), 1, line.size(), stdout);
    std::fputc('\n', stdout);
    std::fflush(stdout);
}

// Samples of any type as they are on the wire, with the four bytes that say how they are encoded.
class Raw : public TopicDataType {
public:
    explicit Raw(const std::string& name) {
        setName(name.c_str());
        m_typeSize = most_bytes;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const Bytes& bytes = *static_cast<Bytes*>(data);
        if (bytes.size() > payload->max_size) return false;
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

std::string hex(const Bytes& bytes) {
    static const char digits[] = "0123456789abcdef";
    std::string text;
    for (unsigned char byte : bytes) {
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

Bytes from_hex(const std::string& text) {
    Bytes bytes;
    for (size_t i = 0; i + 1 < text.size(); i += 2) bytes.push_back(static_cast<unsigned char>(std::stoi(text.substr(i, 2), nullptr, 16)));
    return bytes;
}

class Shown : public DataReaderListener {
public:
    Shown(std::string topic, bool holds) : topic_(std::move(topic)), holds_(holds) {}
    void on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) override {
        say("matched " + topic_ + " " + std::to_string(status.current_count));
    }
    void on_data_available(DataReader* reader) override {
        if (holds_) return;
        Bytes bytes;
        SampleInfo info;
        while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data) say("sample " + topic_ + " " + hex(bytes));
    }

private:
    std::string topic_;
    bool holds_;
};

class Counted : public DataWriterListener {
public:
    explicit Counted(std::string topic) : topic_(std::move(topic)) {}
    void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
        say("matched " + topic_ + " " + std::to_string(status.current_count));
    }

private:
    std::string topic_;
};

template <class Qos>
Qos asked(Qos qos, const std::string& reliability, const std::string& durability, int depth) {
    qos.reliability().kind = reliability == "reliable" ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = durability == "transient_local" ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    if (depth > 0) {
        qos.history().kind = KEEP_LAST_HISTORY_QOS;
        qos.history().depth = depth;
    } else {
        qos.history().kind = KEEP_ALL_HISTORY_QOS;
        qos.resource_limits().max_samples = most_unseen;
        qos.resource_limits().max_samples_per_instance = most_unseen;
        qos.resource_limits().allocated_samples = most_unseen;
    }
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return qos;
}

class Peer {
public:
    Peer(int domain, int lease_s) {
        DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
        if (lease_s > 0) {
            auto& config = qos.wire_protocol().builtin.discovery_config;
            config.leaseDuration = eprosima::fastrtps::Duration_t(lease_s, 0);
            config.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t(1, 0);
        }
        participant_ = DomainParticipantFactory::get_instance()->create_participant(static_cast<DomainId_t>(domain), qos);
        if (participant_ == nullptr) fail("no participant in domain " + std::to_string(domain));
        publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
        subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    }

    void obey(const std::string& line) {
        std::istringstream words(line);
        std::string what, topic, type, reliability, durability, text;
        int depth = 0;
        words >> what >> topic;
        if (what == "send") {
            words >> text;
            Bytes bytes = from_hex(text);
            if (writers_.count(topic) == 0 || !writers_[topic]->write(&bytes)) fail("not sent: " + topic);
            return;
        }
        if (!(words >> type >> reliability >> durability >> depth)) fail("not understood: " + line);
        Topic* made = topic_of(topic, type);
        // What listens lives as long as the peer does.
        if (what == "write") {
            writers_[topic] = publisher_->create_datawriter(made, asked(DATAWRITER_QOS_DEFAULT, reliability, durability, depth), new Counted(topic));
            if (writers_[topic] == nullptr) fail("no writer of " + topic);
        } else if (subscriber_->create_datareader(made, asked(DATAREADER_QOS_DEFAULT, reliability, durability, depth),
                                                  new Shown(topic, what == "hold")) == nullptr) {
            fail("no reader of " + topic);
        }
        say("ready " + topic);
    }

private:
    Topic* topic_of(const std::string& topic, const std::string& type) {
        TypeSupport support(new Raw(type));
        support.register_type(participant_);
        Topic* made = participant_->create_topic(topic, type, TOPIC_QOS_DEFAULT);
        if (made == nullptr) fail("no topic " + topic);
        return made;
    }

    DomainParticipant* participant_;
    Publisher* publisher_;
    Subscriber* subscriber_;
    std::map<std::string, DataWriter*> writers_;
};

} // namespace

int main(int count, char** arguments) {
    if (count < 2 || count > 3) fail("usage: fast_dds DOMAIN [LEASE_S]");
    Peer peer(std::atoi(arguments[1]), count > 2 ? std::atoi(arguments[2]) : 0);
    for (std::string line; std::getline(std::cin, line);) peer.obey(line);
    std::_Exit(0); // without the order in which a library of threads wants to be taken apart
}
