#pragma once

// Configurations and scenes as text, read from a file of their own.

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "scene/config/config.h"

namespace daylit {

class ConfigTest : public testing::Test {
protected:
  std::filesystem::path folder_, file_;
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("daylit_config_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    file_ = folder_ / "CONFIG.toml";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  Result<RunConfig> run(const std::string& text) {
    std::ofstream(file_) << text;
    return read_run_config(file_);
  }
  Result<SimulateConfig> simulate(const std::string& text) {
    std::ofstream(file_) << text;
    return read_simulate_config(file_);
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    return text.replace(at, from.size(), to);
  }
};

} // namespace daylit
