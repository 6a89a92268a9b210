// What the page asks and changes, without a browser.

#include <algorithm>
#include <atomic>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "runtime/page/page_files.h"
#include "runtime/page/scene_editor.h"
#include "runtime/page/scene_routes.h"
#include "test_session.h"

namespace daylit {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

/// A session that is drawn by a thread of its own, and the routes to it.
class Page : public testing::Test {
protected:
  Page() : sky_(*test::sky_image(studio_.sky)), session_(*studio_.open(Backend::rays)) {
    studio_.config.objects[0].model = studio_.folder / "ring.ply";
    std::ofstream(file_) << kFile;
    editor_ = std::make_unique<SceneEditor>(desk_, file_, studio_.config);
    routes_ = scene_routes(desk_, *editor_);
    thread_ = std::thread([this] {
      for (std::uint64_t k = 1; !over_; ++k) {
        if (!paused_) {
          drawn_ok_ = session_.render({sky_, studio_.photo, 1, 1}) && drawn_ok_;
          desk_.serve({session_, has_sky_ ? &sky_ : nullptr});
        }
        std::this_thread::sleep_for(1ms);
      }
    });
  }
  ~Page() override {
    over_ = true;
    thread_.join();
    EXPECT_TRUE(drawn_ok_);
  }
  HttpReply ask(HttpRoute::Method method, const std::string& path, const std::string& body = "",
                std::map<std::string, std::string> query = {}) const {
    for (const HttpRoute& route : routes_)
      if (route.path == path && route.method == method)
        return route.handler({path, body, std::move(query)});
    ADD_FAILURE() << path;
    return {};
  }
  json get(const std::string& path, std::map<std::string, std::string> query = {}) const {
    return json::parse(ask(HttpRoute::Method::get, path, "", std::move(query)).body, nullptr, false);
  }
  HttpReply post(const std::string& path, const json& body) const {
    return ask(HttpRoute::Method::post, path, body.dump());
  }
  std::string file() const {
    std::ifstream in(file_);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static constexpr const char* kFile =
      "# mine\n[[object]]\nmodel = \"ring.ply\" # a ring\nposition = [2.0, 3.4, 0.23]\n"
      "rotation = [70, 0, 0]\n\n[light]\nsamples = 12\n";
  test::Studio studio_;
  std::filesystem::path file_ = studio_.folder / "config.toml";
  SkyImage sky_;
  Session session_;
  SessionDesk desk_;
  std::unique_ptr<SceneEditor> editor_;
  std::vector<HttpRoute> routes_;
  std::atomic<bool> over_ = false, paused_ = false, drawn_ok_ = true, has_sky_ = true;
  std::thread thread_;
};

TEST_F(Page, scene_room_and_light_fit_together) {
  const json scene = get("/scene"), room = get("/scene/room"), light = get("/scene/light");
  ASSERT_EQ(scene["objects"].size(), 1u);
  EXPECT_EQ(scene["objects"][0]["name"], "ring.ply");
  EXPECT_EQ(scene["models"], json::array({"ring.ply"}));
  EXPECT_EQ(scene["photo"], json::array({test::Studio::kWidth, test::Studio::kHeight}));
  EXPECT_EQ(room["corners"].size() % 9, 0u);
  EXPECT_EQ(room["colours"].size(), room["corners"].size() / 3);
  EXPECT_GE(room["windows"].size(), 1u);
  ASSERT_GT(room["probes"].size(), 0u);
  EXPECT_LE(room["probes"].size(), 1200u);
  EXPECT_EQ(light["probes"].size(), 9 * room["probes"].size());
  EXPECT_GT(light["probes"][0].get<double>(), 0.0);
  EXPECT_EQ(light["sky_samples"].size() + light["sun_samples"].size(), 12u);
  EXPECT_EQ(ask(HttpRoute::Method::get, "/scene/sky.jpg").body.substr(0, 2), "\xff\xd8");
}

TEST_F(Page, before_the_first_sky_there_is_no_light_and_that_is_no_error) {
  has_sky_ = false;
  for (const char* path : {"/scene/light", "/scene/regions"}) {
    const HttpReply reply = ask(HttpRoute::Method::get, path);
    EXPECT_EQ(reply.status, 200) << path;
    EXPECT_EQ(reply.body, "null") << path;
  }
}

TEST_F(Page, outlines_lie_where_two_regions_meet_and_every_region_that_counts_has_one) {
  const json regions = get("/scene/regions");
  const SkyPartition& partition = session_.volume().partition;
  const SkyGeometry& geometry = *sky_.geometry();
  EXPECT_EQ(regions["of"], partition.size());
  std::string path = regions["path"];
  std::ranges::replace_if(
      path, [](char c) { return c == 'M' || c == 'L'; }, ' ');
  std::istringstream numbers(path);
  std::set<int> outlined;
  for (glm::dvec2 at; numbers >> at.x >> at.y;) {
    std::set<int> around;
    bool beside_the_picture =
        at.x < 0.5 || at.y < 0.5 || at.x > geometry.width() - 1.5 || at.y > geometry.height() - 1.5;
    for (const glm::dvec2 step : {glm::dvec2(0.6, 0.4), {-0.6, 0.4}, {0.6, -0.4}, {-0.6, -0.4}})
      if (const auto direction = geometry.direction(at + step))
        around.insert(partition.region_of(*direction));
      else
        beside_the_picture = true;
    EXPECT_TRUE(around.size() > 1 || beside_the_picture) << at.x << " " << at.y;
    outlined.insert(around.begin(), around.end());
  }
  const std::vector<std::uint8_t> counts = regions_that_count(session_.volume());
  ASSERT_GT(regions["count"], 0);
  for (int region = 0; region < partition.size(); ++region)
    if (counts[static_cast<std::size_t>(region)] && geometry.pixel(partition.centre(region))) {
      EXPECT_TRUE(outlined.contains(region)) << region;
    }
}

TEST_F(Page, what_is_picked_and_dragged_comes_under_the_pointer) {
  const json before = get("/scene")["objects"][0];
  const RenderCamera& camera = session_.camera(); // it stands
  const glm::dvec3 foot{before["position"][0], before["position"][1], before["position"][2]};
  const glm::dvec3 local = glm::transpose(glm::dmat3(camera.world_from_camera)) * (foot - camera.eye());
  std::optional<json> picked;
  for (int y = 0; y < test::Studio::kHeight && !picked; y += 3) // a ring has a hole
    for (int x = 0; x < test::Studio::kWidth && !picked; x += 3)
      if (json at = get("/scene/pick", {{"x", std::to_string(x)}, {"y", std::to_string(y)}}); !at["object"].is_null())
        picked = std::move(at);
  ASSERT_TRUE(picked);
  EXPECT_EQ((*picked)["object"], 0);
  EXPECT_EQ(get("/scene/pick", {{"x", "-500"}, {"y", "-500"}})["object"], nullptr);
  // Without a grip the foot comes where the pointer is.
  const double x = 40, y = 40;
  EXPECT_EQ(post("/scene/change", {{"object", 0}, {"pixel", {x, y}}}).status, 200);
  const json after = get("/scene")["objects"][0];
  const glm::dvec3 now{after["position"][0], after["position"][1], after["position"][2]};
  EXPECT_EQ(now.z, foot.z);
  const glm::dvec3 seen = glm::transpose(glm::dmat3(camera.world_from_camera)) * (now - camera.eye());
  EXPECT_NEAR(camera.cx + camera.fx * seen.x / seen.z, x, 0.1);
  EXPECT_NEAR(camera.cy + camera.fy * seen.y / seen.z, y, 0.1);
  EXPECT_GT(glm::length(seen - local), 0.05);
}

TEST_F(Page, objects_come_go_and_are_saved_with_comments_and_order) {
  EXPECT_EQ(post("/scene/change", {{"object", 0}, {"rotation", {70, 0, 30}}, {"scale", 1.5}}).status, 200);
  EXPECT_EQ(post("/scene/add", {{"model", 0}, {"position", {2.4, 3.0, 0.25}}}).status, 200);
  ASSERT_EQ(get("/scene")["objects"].size(), 2u);
  EXPECT_EQ(file(), kFile) << "nothing is written before it is saved";
  EXPECT_EQ(post("/scene/save", {}).status, 200);
  EXPECT_EQ(file(), "# mine\n[[object]]\nmodel = \"ring.ply\" # a ring\nscale = 1.5\nposition = [2.0, 3.4, 0.23]\n"
                    "rotation = [70, 0, 30]\n\n[[object]]\nmodel = \"ring.ply\"\nposition = [2.4, 3, 0.25]\n"
                    "rotation = [0, 0, 0]\nscale = 1\n\n[light]\nsamples = 12\n");
  EXPECT_EQ(post("/scene/remove", {{"object", 0}}).status, 200);
  EXPECT_EQ(post("/scene/save", {}).status, 200);
  EXPECT_EQ(file(), "[[object]]\nmodel = \"ring.ply\"\nposition = [2.4, 3, 0.25]\nrotation = [0, 0, 0]\nscale = 1\n\n"
                    "[light]\nsamples = 12\n");
  EXPECT_EQ(post("/scene/remove", {{"object", 0}}).status, 200);
  EXPECT_EQ(get("/scene")["objects"].size(), 0u);
}

TEST_F(Page, a_file_that_another_has_changed_is_not_overwritten) {
  std::ofstream(file_) << "[light]\nsamples = 12\n";
  const HttpReply refused = post("/scene/save", {});
  EXPECT_EQ(refused.status, 400);
  EXPECT_NE(refused.body.find("changed by somebody else"), std::string::npos);
  EXPECT_EQ(file(), "[light]\nsamples = 12\n");
  std::ofstream(file_) << kFile << "# theirs\n";
  EXPECT_EQ(post("/scene/change", {{"object", 0}, {"scale", 1.5}}).status, 200);
  EXPECT_EQ(post("/scene/save", {}).status, 400) << "the same objects, another text";
  EXPECT_EQ(file(), std::string(kFile) + "# theirs\n");
}

TEST_F(Page, without_frames_a_change_is_refused_and_not_done_later) {
  get("/scene"); // the first frame, which takes longest
  paused_ = true;
  std::this_thread::sleep_for(20ms);
  std::atomic<int> done = 0;
  const auto asked = desk_.ask(
      [&](const BetweenFrames&) -> Result<void> {
        ++done;
        return {};
      },
      50ms);
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().code, ErrorCode::device);
  paused_ = false;
  get("/scene"); // a frame later
  EXPECT_EQ(done, 0);
}

/// Bodies cut off, changed and made up: an answer in words each time, and the scene stays sound.
TEST_F(Page, no_request_breaks_the_scene) {
  std::mt19937 random(7);
  const std::vector<std::string> seeds{R"({"object":0,"position":[1,2,3],"rotation":[1,2,3],"scale":2})",
                                       R"({"object":0,"pixel":[10,20],"grip":[0.1,0.2]})",
                                       R"({"object":18446744073709551615,"scale":1e999})",
                                       R"({"direct":false,"indirect":"no","differential":null})",
                                       "[[[[[[",
                                       "",
                                       "null"};
  for (int k = 0; k < 2000; ++k) {
    std::string body = seeds[random() % seeds.size()];
    for (std::size_t flips = random() % 4; flips > 0 && !body.empty(); --flips)
      body[random() % body.size()] = static_cast<char>(random());
    body.resize(body.size() - (body.empty() ? 0 : random() % body.size() / 2));
    const char* path = k % 3 == 0 ? "/scene/show" : "/scene/change";
    const HttpReply reply = ask(HttpRoute::Method::post, path, body);
    EXPECT_TRUE(reply.status == 200 || reply.body.find("error") != std::string::npos) << body;
    const HttpReply picked = ask(HttpRoute::Method::get, "/scene/pick", "", {{"x", body}, {"y", "1e308"}});
    EXPECT_NE(picked.status, 0);
  }
  const json object = get("/scene")["objects"][0];
  for (const json& number : object["position"])
    EXPECT_TRUE(number.is_number()) << object;
}

TEST_F(Page, a_change_of_another_kind_is_refused_with_the_key) {
  const std::pair<const char*, std::pair<json, const char*>> wrong[] = {
      {"/scene/change", {{{"object", 0}, {"scale", "x"}}, "\"scale\" must be a number"}},
      {"/scene/change", {{{"object", 0}, {"position", {1, 2}}}, "\"position\" must be 3 numbers"}},
      {"/scene/change", {{{"object", 0}, {"scael", 2}}, "unknown key \"scael\""}},
      {"/scene/change", {{{"object", -1}, {"scale", 2}}, "\"object\" must be an index"}},
      {"/scene/show", {{{"direct", 1}}, "\"direct\" must be true or false"}},
      {"/scene/show", {json::array(), "a JSON object"}},
      {"/scene/add", {{{"model", 0}, {"position", {1, 2, 3}}, {"scale", 2}}, "unknown key"}},
      {"/scene/remove", {{{"object", "0"}}, "must be an index"}},
  };
  for (const auto& [path, change] : wrong) {
    const HttpReply reply = post(path, change.first);
    EXPECT_EQ(reply.status, 400) << path << " " << change.first;
    EXPECT_NE(json::parse(reply.body)["error"].get<std::string>().find(change.second), std::string::npos) << reply.body;
  }
}

TEST(PageFiles, the_page_names_only_files_that_are_served) {
  std::map<std::string, std::string> files;
  for (const HttpRoute& route : page_files())
    files[route.path] = route.handler({}).body;
  ASSERT_TRUE(files.contains("/"));
  for (const auto& [path, text] : files) {
    if (path == "/three.js")
      continue;
    EXPECT_EQ(text.find("http://www.w3.org/2000/svg") == std::string::npos && text.find("://") != std::string::npos,
              false)
        << path << " names another server";
    std::istringstream words(text);
    for (std::string line; std::getline(words, line);)
      for (const char* quote : {"src=\"/", "href=\"/", "from \"/"})
        if (const std::size_t at = line.find(quote); at != std::string::npos) {
          const std::size_t begin = at + std::string(quote).size() - 1;
          EXPECT_TRUE(files.contains(line.substr(begin, line.find('"', begin) - begin))) << line;
        }
  }
}

} // namespace
} // namespace daylit
