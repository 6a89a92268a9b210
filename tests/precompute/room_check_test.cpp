#include "precompute/room_check.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "precompute/check_plot.h"
#include "precompute/planned_bake.h"

namespace daylit::precompute {
namespace {

const Progress kSilent = [](const std::string&, double) { return true; };

/// A box of 2 x 3 x 2.5 m, times `scale`, with a pane of 2 x 2.5 m, all of the wall y = 0.
std::string box(double scale, const std::string& pane) {
  std::string text = "mtllib m.mtl\n";
  for (int i = 0; i < 8; ++i)
    text += "v " + std::to_string(i & 1 ? 2 * scale : 0) + " " + std::to_string(i & 2 ? 3 * scale : 0) + " " +
            std::to_string(i & 4 ? 2.5 * scale : 0) + "\n";
  return text + "usemtl wall\nf 1 2 4 3\nf 5 7 8 6\nf 2 6 8 4\nf 4 8 7 3\nf 3 7 5 1\nusemtl " + pane + "\nf 1 5 6 2\n";
}

class RoomCheckFile : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-check-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::ofstream(folder_ / "m.mtl") << "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl window\nKd 0 0 0\nTf 0.8 0.7 0.6\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  Result<RoomCheck> check(const std::string& obj) {
    std::ofstream(folder_ / "room.obj") << obj;
    return check_room(folder_ / "room.obj", UpAxis::z, 0, kSilent);
  }
  /// What the bake makes of the same file.
  Result<PlannedBake> bake() {
    const auto room = read_room(folder_ / "room.obj", UpAxis::z);
    EXPECT_TRUE(room);
    return bake_to_error(*room, {}, nullptr, kSilent, [](const std::string&) {});
  }
  std::filesystem::path folder_;
};

TEST_F(RoomCheckFile, finds_openings_materials_and_the_cost) {
  const auto r = check(box(1, "window"));
  ASSERT_TRUE(r) << r.error().message();
  EXPECT_FALSE(r->problem) << r->problem->message();
  ASSERT_EQ(r->openings.size(), 1u);
  EXPECT_NEAR(r->openings[0].area_m2, 5.0, 1e-9);
  EXPECT_NEAR(r->openings[0].inward.y, 1.0, 1e-9);
  EXPECT_NEAR(r->openings[0].centre_m.z, 1.25, 1e-9);
  ASSERT_EQ(r->materials.size(), 2u);
  EXPECT_NEAR(r->materials[0].area_m2 + r->materials[1].area_m2, 2 * (6 + 5 + 7.5), 1e-9);
  ASSERT_TRUE(r->estimate);
  EXPECT_GT(r->estimate->counts.facets, 100u);
  EXPECT_GT(r->estimate->plan.predicted.seconds, 0.0);
  EXPECT_TRUE(r->survey.questions.empty()) << r->survey.questions.front();
  const auto json = nlohmann::json::parse(to_json(*r));
  EXPECT_EQ(json["openings"]["windows"], 1);
  EXPECT_EQ(json["can_be_baked"], true);
  EXPECT_NE(to_text(*r).find("lowest corner"), std::string::npos);
}

TEST_F(RoomCheckFile, promises_what_the_bake_then_does) {
  const auto checked = check(box(1, "window"));
  ASSERT_TRUE(checked && checked->estimate);
  const BakeReport& promised = checked->estimate->counts;
  const auto baked = bake();
  ASSERT_TRUE(baked) << baked.error().message();
  ASSERT_FALSE(baked->repeated);
  EXPECT_EQ(promised.facets, baked->report.facets);
  EXPECT_EQ(promised.patches, baked->report.patches);
  EXPECT_EQ(promised.elements, baked->report.elements);
  EXPECT_EQ(promised.probes, baked->report.probes);
  EXPECT_EQ(promised.probes_valid, baked->report.probes_valid);
  const double bytes = static_cast<double>(baked->report.exchange.bytes);
  EXPECT_NEAR(static_cast<double>(promised.exchange.bytes), bytes, 0.3 * bytes); // ranks are expected, not known
  EXPECT_EQ(checked->estimate->plan.predicted.bytes, baked->plan.predicted.bytes);
  EXPECT_EQ(checked->estimate->plan.regions, baked->plan.regions);
}

TEST_F(RoomCheckFile, refuses_what_the_bake_refuses_in_the_same_words) {
  const std::string apart = "mtllib m.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 9 9 9\nv 9 9 8\nv 9 8 9\n"
                            "usemtl wall\nf 1 2 3 4\nusemtl window\nf 5 6 7\n";
  for (const std::string& room : {box(1, "wall"), apart}) {
    const auto checked = check(room);
    ASSERT_TRUE(checked);
    ASSERT_TRUE(checked->problem);
    const auto baked = bake();
    ASSERT_FALSE(baked);
    EXPECT_EQ(checked->problem->what, baked.error().what);
  }
}

TEST_F(RoomCheckFile, a_closed_room_is_a_report_with_a_problem) {
  const auto r = check(box(1, "wall"));
  ASSERT_TRUE(r) << r.error().message();
  ASSERT_TRUE(r->problem);
  EXPECT_EQ(r->problem->code, ErrorCode::geometry_invalid);
  EXPECT_NE(r->problem->message().find("room.obj"), std::string::npos) << r->problem->message();
  EXPECT_NE(to_text(*r).find("cannot be baked"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(to_json(*r))["can_be_baked"], false);
}

TEST_F(RoomCheckFile, a_room_in_centimetres_is_questioned) {
  const auto r = check(box(100, "window"));
  ASSERT_TRUE(r) << r.error().message();
  ASSERT_FALSE(r->survey.questions.empty());
  EXPECT_NE(r->survey.questions[0].find("centimetres"), std::string::npos) << r->survey.questions[0];
}

TEST_F(RoomCheckFile, a_room_in_millimetres_cannot_be_baked) {
  const auto r = check(box(1000, "window"));
  ASSERT_TRUE(r) << r.error().message();
  ASSERT_TRUE(r->problem);
  EXPECT_NE(r->problem->message().find("must be in metres"), std::string::npos) << r->problem->message();
}

TEST_F(RoomCheckFile, an_unreadable_room_is_an_error) {
  EXPECT_FALSE(check("v 0 0 0\nf 1 2 3\n"));
  EXPECT_EQ(check_room(folder_ / "no.obj", UpAxis::z, 0, kSilent).error().code, ErrorCode::file_missing);
}

TEST_F(RoomCheckFile, joints_that_do_not_close_are_told_and_closed_on_request) {
  // The floor lies 4 mm below the walls and reaches beyond them.
  std::string open = box(1, "window");
  open.replace(open.find("f 1 2 4 3\n"), 10, "");
  open += "v -0.5 -0.5 -0.004\nv 2.5 -0.5 -0.004\nv 2.5 3.5 -0.004\nv -0.5 3.5 -0.004\nusemtl wall\nf 9 10 11 12\n";
  std::ofstream(folder_ / "room.obj") << open;
  auto room = read_room(folder_ / "room.obj", UpAxis::z);
  ASSERT_TRUE(room);
  const std::string hash = room->content_hash;
  RoomSurvey told, closed;
  ASSERT_TRUE(survey_room(*room, 0, told));
  EXPECT_NEAR(told.gaps.widest_m, 0.004, 1e-6);
  EXPECT_NEAR(told.gap_light, 0.004 * 10 / (5 * 0.8), 1e-3);
  ASSERT_EQ(told.questions.size(), 1u);
  EXPECT_NE(told.questions[0].find("--close-gaps 4"), std::string::npos) << told.questions[0];
  EXPECT_EQ(room->content_hash, hash);
  ASSERT_TRUE(survey_room(*room, 0.004, closed));
  EXPECT_TRUE(closed.gaps.list.empty());
  EXPECT_TRUE(closed.questions.empty());
  EXPECT_NE(room->report.notes.back().find("gaps at joints closed"), std::string::npos);
  EXPECT_NE(room->content_hash, hash);
}

TEST_F(RoomCheckFile, the_page_loads_nothing_and_holds_what_was_found) {
  std::ofstream(folder_ / "m.mtl") << "newmtl </script><b>\nKd 0.5 0.5 0.5\nnewmtl window\nTf 0.8 0.7 0.6\n";
  std::string text = box(1, "window");
  for (std::size_t at = text.find("wall"); at != std::string::npos; at = text.find("wall"))
    text.replace(at, 4, "</script><b>");
  std::ofstream(folder_ / "room.obj") << text;
  auto file = read_room(folder_ / "room.obj", UpAxis::z);
  ASSERT_TRUE(file) << file.error().message();
  RoomCheck check;
  ASSERT_TRUE(survey_room(*file, 0, check.survey));
  check.file = "@DATA@ <i>";
  check.materials = {{"</script><b>", Rgb(0.5f), Rgb(0.0f), 0.0f, false, 10, 25.0}};
  check.bounds = file->room.bounds();
  check.room = file->room;
  const auto page = check_page(check);
  ASSERT_TRUE(page) << page.error().message();
  const std::size_t data = page->find("application/json\">") + 18, end = page->find("</script>", data),
                    library_end = page->find("</script>", end + 9);
  const auto json = nlohmann::json::parse(page->substr(data, end - data));
  EXPECT_EQ(json["windows"].size(), 1u);
  EXPECT_EQ(json["triangles"].size(), 10u * 9u);
  const std::string own = page->substr(0, end) + page->substr(library_end);
  for (const char* outside : {"src=", "href=", "url(", "import", "fetch(", "http:", "https:", "</script><b>", "<i>"})
    EXPECT_EQ(own.find(outside), std::string::npos) << outside;
  EXPECT_GT(library_end - end, 500'000u) << "three.js stands in the page";
}

} // namespace
} // namespace daylit::precompute
