// Asks Fast DDS what an enclave may do: reads lines `publish TOPIC` or `subscribe TOPIC`, tries to create the
// writer or the reader, and prints the line with `yes` or `no`.
//
//     probe ENCLAVE_FOLDER [SECONDS]
//
// With SECONDS the last writer and reader stay for that time: the writer writes ten times a second, and what
// the reader received is counted at the end. ENCLAVE_FOLDER `-` stands for a stranger without keys.

#include <chrono>
#include <cstring>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::rtps;

// A number; what is sent plays no part.
struct NumberType : TopicDataType
{
  NumberType() { setName("Number"); m_typeSize = 64; m_isGetKeyDefined = false; }
  bool serialize(void * data, SerializedPayload_t * payload) override
  {
    payload->length = sizeof(int64_t);
    std::memcpy(payload->data, data, sizeof(int64_t));
    return true;
  }
  bool deserialize(SerializedPayload_t * payload, void * data) override
  {
    std::memcpy(data, payload->data, sizeof(int64_t));
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void *) override
  {
    return [] {return static_cast<uint32_t>(sizeof(int64_t));};
  }
  void * createData() override { return new int64_t(0); }
  void deleteData(void * data) override { delete static_cast<int64_t *>(data); }
  bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

// A participant on this machine alone, without shared memory, in which another version of Fast DDS would be met.
DomainParticipantQos stranger()
{
  DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  qos.transport().user_transports.push_back(transport);
  return qos;
}

// The properties that rmw_fastrtps sets for an enclave.
DomainParticipantQos qos_of(const std::string & folder)
{
  DomainParticipantQos qos = stranger();
  const std::string files = "file://" + folder + "/";
  const std::string authentication = "dds.sec.auth.builtin.PKI-DH.";
  const std::string access = "dds.sec.access.builtin.Access-Permissions.";
  auto set = [&qos](const std::string & name, const std::string & value) {
      qos.properties().properties().emplace_back(name, value);
    };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set(authentication + "identity_ca", files + "identity_ca.cert.pem");
  set(authentication + "identity_certificate", files + "cert.pem");
  set(authentication + "private_key", files + "key.pem");
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set(access + "permissions_ca", files + "permissions_ca.cert.pem");
  set(access + "governance", files + "governance.p7s");
  set(access + "permissions", files + "permissions.p7s");
  return qos;
}

int main(int count, char ** arguments)
{
  if (count < 2) {
    std::cerr << "usage: probe ENCLAVE_FOLDER [SECONDS]\n";
    return 2;
  }
  const std::string folder = arguments[1];
  const int seconds = count > 2 ? std::stoi(arguments[2]) : 0;
  // What is refused is logged too, in the middle of our lines.
  Log::ClearConsumers();
  auto * participant = DomainParticipantFactory::get_instance()->create_participant(
    0, folder == "-" ? stranger() : qos_of(folder));
  if (participant == nullptr) {
    std::cerr << "no participant: the enclave's keys or permissions were refused\n";
    return 1;
  }
  TypeSupport type(new NumberType);
  type.register_type(participant);
  auto * publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto * subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataWriter * writer = nullptr;
  DataReader * reader = nullptr;
  std::string rule, name;
  while (std::cin >> rule >> name) {
    auto * topic = participant->create_topic(name, "Number", TOPIC_QOS_DEFAULT);
    bool allowed;
    if (rule == "publish") {
      writer = publisher->create_datawriter(topic, DATAWRITER_QOS_DEFAULT);
      allowed = writer != nullptr;
    } else {
      reader = subscriber->create_datareader(topic, DATAREADER_QOS_DEFAULT);
      allowed = reader != nullptr;
    }
    std::cout << rule << " " << name << (allowed ? " yes" : " no") << std::endl;
    if (seconds == 0) {
      if (writer != nullptr) {publisher->delete_datawriter(writer);}
      if (reader != nullptr) {subscriber->delete_datareader(reader);}
      writer = nullptr;
      reader = nullptr;
      participant->delete_topic(topic);
    }
  }
  int64_t number = 0;
  int received = 0;
  for (int tick = 0; tick < 10 * seconds; ++tick) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (writer != nullptr) {writer->write(&++number);}
    SampleInfo info;
    int64_t sample;
    while (reader != nullptr &&
      reader->take_next_sample(&sample, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    {
      received += info.valid_data ? 1 : 0;
    }
  }
  if (seconds > 0) {std::cout << "received " << received << std::endl;}
  std::cout.flush();
  // The libraries' threads end with the process.
  std::_Exit(0);
}
