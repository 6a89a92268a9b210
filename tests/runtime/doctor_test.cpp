// Each fault is planted; the finding must name it and say what to change.

#include "runtime/doctor/doctor.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include <arv.h>
#include <fcntl.h>
#include <sys/file.h>

#include <gtest/gtest.h>

#include "test_session.h"

namespace daylit {
namespace {

using Level = Finding::Level;

/// The worst of the findings about a subject.
Finding worst(const Findings& all, const std::string& subject) {
  Finding found{Level::ok, "", "nothing was said about " + subject, ""};
  for (const Finding& f : all)
    if (f.subject == subject && (found.subject.empty() || f.level > found.level))
      found = f;
  return found;
}

void expect(const Finding& f, Level level, const std::string& found, const std::string& change = "") {
  EXPECT_EQ(static_cast<int>(f.level), static_cast<int>(level)) << f.found;
  EXPECT_NE(f.found.find(found), std::string::npos) << f.found;
  EXPECT_NE(f.change.find(change), std::string::npos) << f.change;
  EXPECT_EQ(f.change.empty(), level == Level::ok) << "each fault, and only a fault, says what to change";
}

/// eth0 in 192.168.0.0/24.
Machine machine(int mtu) {
  return {{{"lo", 0x7F000001, 0xFF000000, 65536, true}, {"eth0", 0xC0A80001, 0xFFFFFF00, mtu, false}}, 8'000'000};
}

const std::vector<FoundCamera> kFound{{"Maker-Model-17", "192.168.0.10"}, {"Other-18", "10.0.0.5"}, {"Usb-19", ""}};
constexpr std::size_t kFrame_bytes = 500'000;

Findings camera(const std::string& name, int packet_bytes, const Machine& m) {
  CameraConfig c;
  c.camera = name;
  c.packet_bytes = packet_bytes;
  return check_camera(c, "camera", kFound, m, kFrame_bytes);
}

TEST(Doctor, a_camera_on_a_good_network_is_well) {
  for (const char* name : {"Maker-Model-17", "192.168.0.10", "Usb-19"})
    expect(worst(camera(name, 9000, machine(9000)), "camera"), Level::ok, "answers");
}

TEST(Doctor, a_camera_that_does_not_answer_is_an_error_that_lists_those_that_do) {
  expect(worst(camera("192.168.0.11", 0, machine(9000)), "camera"), Level::error,
         "there are: Maker-Model-17 at 192.168", "power and cable");
}

TEST(Doctor, a_camera_in_no_network_of_the_machine_is_an_error) {
  expect(worst(camera("Other-18", 0, machine(9000)), "camera"), Level::error, "10.0.0.5 lies in no network", "address");
}

TEST(Doctor, packets_that_do_not_fit_are_an_error_and_small_ones_a_warning) {
  expect(worst(camera("Maker-Model-17", 9000, machine(1500)), "camera"), Level::error, "packet_size is 9000",
         "ip link set dev eth0 mtu 9000");
  expect(worst(camera("Maker-Model-17", 0, machine(1500)), "camera"), Level::warning, "1500 bytes", "mtu 9000");
}

TEST(Doctor, a_receive_buffer_smaller_than_two_frames_is_a_warning_with_the_number_to_set) {
  Machine m = machine(9000);
  m.most_socket_bytes = 212'992;
  expect(worst(camera("Maker-Model-17", 9000, m), "camera"), Level::warning, "212 kB for frames of 500 kB",
         "net.core.rmem_max=1000000");
}

TEST(Doctor, the_narrowest_network_counts) {
  Machine m = machine(9000);
  m.interfaces.push_back({"vpn", 0x0A000001, 0, 1400, false}); // everything
  EXPECT_EQ(network_of(m, "192.168.0.10")->name, "eth0");
  EXPECT_EQ(network_of(m, "8.8.8.8")->name, "vpn");
  EXPECT_EQ(network_of(m, "Maker-Model-17"), nullptr);
}

TEST(Doctor, this_machine_has_a_loopback_network_and_a_limit_of_socket_buffers) {
  const Machine m = read_machine();
  const NetworkInterface* network = network_of(m, "127.0.0.1");
  ASSERT_NE(network, nullptr);
  EXPECT_TRUE(network->is_loopback);
  EXPECT_GT(network->mtu_bytes, 1000);
  EXPECT_GT(m.most_socket_bytes, 1000);
}

/// A studio is live; without pictures.
struct LiveStudio : test::Studio {
  LiveStudio() {
    config.sky.camera = CameraConfig{};
    config.interior.camera = CameraConfig{};
  }
};

TEST(Doctor, good_inputs_are_well) {
  const LiveStudio s;
  for (const Finding& f : check_inputs(s.config))
    expect(f, Level::ok, "");
}

TEST(Doctor, a_damaged_volume_is_an_error) {
  const LiveStudio s;
  std::fstream file(s.config.volume, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(-20, std::ios::end);
  file.put('\x55');
  file.close();
  expect(worst(check_inputs(s.config), "volume"), Level::error, "room.volume", "");
}

TEST(Doctor, a_volume_of_another_room_is_an_error) {
  LiveStudio s;
  auto volume = *read_volume(s.config.volume);
  volume.provenance.room_hash = "0123456789abcdef";
  ASSERT_TRUE(write_volume(s.config.volume, volume));
  s.config.room_model = s.folder / "room.obj";
  std::ofstream(s.config.room_model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  expect(worst(check_inputs(s.config), "volume"), Level::error, "baked from another room", "bake the room again");
}

TEST(Doctor, an_object_outside_the_room_and_a_camera_in_a_wall_are_warnings) {
  LiveStudio s;
  s.config.objects[0].position = {50, 0, 0};
  s.config.world_from_camera = look_at({-7, 4, 1}, {2, 3, 0});
  expect(worst(check_inputs(s.config), "object 1"), Level::warning, "outside the room", "position");
  expect(worst(check_inputs(s.config), "pose"), Level::warning, "not in the air", "[pose]");
}

TEST(Doctor, the_lens_of_an_ordinary_camera_for_the_sky_is_a_warning) {
  LiveStudio s;
  s.config.sky.projection = "fisheye";
  s.config.sky.lens = s.config.interior.lens;
  expect(worst(check_inputs(s.config), "sky lens"), Level::warning, "not of a fish-eye", "daylit-calibrate fisheye");
}

TEST(Doctor, files_that_are_missing_are_errors) {
  LiveStudio s;
  s.config.objects[0].model = s.folder / "none.obj";
  s.config.interior.lens = s.folder / "none.yaml";
  s.config.interior.response = (s.folder / "none.txt").string();
  const Findings all = check_inputs(s.config);
  expect(worst(all, "object 1"), Level::error, "none.obj", "path");
  expect(worst(all, "interior lens"), Level::error, "none.yaml", "path");
  expect(worst(all, "interior response"), Level::error, "none.txt", "path");
}

TEST(Doctor, a_folder_that_is_missing_or_full_is_an_error) {
  LiveStudio s;
  EXPECT_EQ(worst(check_disks(s.config), "disk").found.find(s.folder.string()), 0u);
  s.config.output.png = s.folder / "there/out.png";
  expect(worst(check_disks(s.config), "disk"), Level::error, "does not exist", "mkdir");
  s.config.output.png = "/proc/out.png"; // has no room at all
  expect(worst(check_disks(s.config), "disk"), Level::error, "/proc", "make room");
}

TEST(Doctor, a_port_in_use_is_a_warning_and_a_short_or_open_token_is_said) {
  const LiveStudio s;
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(socket, 1), 0);
  socklen_t size = sizeof address;
  getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);

  HttpConfig http{ntohs(address.sin_port), "127.0.0.1", s.folder / "token"};
  std::ofstream(http.token_file) << "short\n";
  expect(worst(check_http(http), "http"), Level::warning, "another program listens", "port");
  expect(worst(check_http(http), "http token"), Level::error, "5 characters", "openssl rand");
  std::ofstream(http.token_file) << "0123456789abcdef0123456789abcdef";
  std::filesystem::permissions(http.token_file, std::filesystem::perms(0644));
  expect(worst(check_http(http), "http token"), Level::warning, "every user", "chmod 600");
  std::filesystem::permissions(http.token_file, std::filesystem::perms(0600));
  ::close(socket);
  for (const Finding& f : check_http(http))
    expect(f, Level::ok, "");
}

TEST(Doctor, an_address_that_the_daemon_cannot_have_and_markers_that_it_does_not_know_are_errors) {
  for (const char* address : {"999.1.1.1", "198.51.100.7"}) // no address; one for documentation
    expect(worst(check_http({0, address, {}}), "http"), Level::error, "no address of this machine", "[http] address");
  LiveStudio s;
  s.config.marker = MarkerConfig{};
  s.config.marker->dictionary = "6X6_25";
  s.config.marker->ids = {23};
  expect(worst(check_inputs(s.config), "marker"), Level::error, "6X6_25", "");
  s.config.marker->dictionary = "6X6_250";
  s.config.marker->ids = {250};
  expect(worst(check_inputs(s.config), "marker"), Level::error, "no marker 250", "");
}

/// The port of the control channel is one per machine: tests that run beside this one wait.
TEST(DoctorAndCamera, a_camera_of_another_size_than_its_lens_file_is_an_error) {
  const int lock = open("/tmp/daylit-camera-test.lock", O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  ASSERT_GE(lock, 0);
  flock(lock, LOCK_EX);
  ArvGvFakeCamera* fake = arv_gv_fake_camera_new("127.0.0.1", "daylit-doctor");
  if (!fake || !arv_gv_fake_camera_is_running(fake)) {
    close(lock);
    GTEST_SKIP() << "no loopback network, or its port of GigE Vision is in use";
  }
  const LiveStudio s;
  CameraConfig c;
  c.camera = "127.0.0.1";
  c.pixel_format = "Mono8";
  c.packet_bytes = 8192;
  expect(check_frame(c, "camera", s.config.interior.lens), Level::ok, "sends 72 x 69 pixels, mono of 8 bits");
  c.width_px = 64, c.height_px = 48;
  expect(check_frame(c, "camera", s.config.interior.lens), Level::error, "64 x 48", "lens");
  g_object_unref(fake);
  close(lock);
}

} // namespace
} // namespace daylit
