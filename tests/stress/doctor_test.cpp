#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "good_files.h"

namespace daylit::test {
namespace {

class DoctorCommand : public GoodFiles {
protected:
  void SetUp() override {
    if (!has_program("daylit-run"))
      GTEST_SKIP() << "this build has no daylit-run";
  }
};

TEST_F(DoctorCommand, exit_code_is_1_exactly_where_something_must_be_changed) {
  const fs::path f = copy_for("doctor");
  const Outcome well = run_in(f, "daylit-run doctor config.toml");
  EXPECT_EQ(well.exit_code, 0) << well.out << well.err;
  EXPECT_EQ(well.out.find("error"), std::string::npos) << well.out;
  fs::remove(f / "cube.obj");
  const Outcome ill = run_in(f, "daylit-run doctor config.toml --quiet");
  EXPECT_EQ(ill.exit_code, 1);
  EXPECT_EQ(ill.out.find("error    object 1: cube.obj"), 0u) << ill.out;
}

TEST_F(DoctorCommand, json_is_one_object_per_finding) {
  const fs::path f = copy_for("doctor-json");
  edit(f / "config.toml", "room.volume", "other.volume");
  const Outcome said = run_in(f, "daylit-run doctor config.toml --json");
  EXPECT_EQ(said.exit_code, 1);
  std::istringstream lines(said.out);
  int errors = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto finding = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(finding.is_object()) << line;
    if (finding["level"] == "error") {
      ++errors;
      EXPECT_EQ(finding["subject"], "volume");
      EXPECT_NE(finding["change"], "");
    }
  }
  EXPECT_EQ(errors, 1);
}

/// Every problem of the file, each with its line, before anything is looked at.
TEST_F(DoctorCommand, a_wrong_configuration_is_the_only_finding) {
  const fs::path f = copy_for("doctor-config");
  edit(f / "config.toml", "image = \"sky.exr\"", "imagee = \"sky.exr\"");
  const Outcome said = run_in(f, "daylit-run doctor config.toml");
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_EQ(said.out.find("error    configuration: config.toml, line"), 0u) << said.out;
  EXPECT_NE(said.out.find("imagee"), std::string::npos) << said.out;
}

} // namespace
} // namespace daylit::test
