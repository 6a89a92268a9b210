// The rules by which an MTL material becomes a surface (docs/materials.md).

#include "scene/model/mtl_material.h"

#include <cmath>

#include <gtest/gtest.h>

namespace daylit {
namespace {

Result<ObjectMaterial> read(const std::string& lines) {
  const auto all = detail::parse_mtl_text("newmtl paint\n" + lines, "a.mtl");
  if (!all)
    return all.error();
  return detail::material_from_mtl(all->front(), Rgb(0.7f), "a.obj, material paint");
}

TEST(MtlMaterial, without_ks_it_is_diffuse) {
  for (const char* lines :
       {"Kd 0.6 0.1 0.1\n", "Kd 0.6 0.1 0.1\nillum 2\nNs 250\nNi 1.45\n", "Kd 0.6 0.1 0.1\nKs 0 0 0\nNs 96\nillum 2\n",
        "Kd 0.6 0.1 0.1\nKs 0.5 0.5 0.5\nillum 1\n"}) {
    const auto m = read(lines);
    ASSERT_TRUE(m) << m.error().message();
    EXPECT_FALSE(m->is_glossy()) << lines;
    EXPECT_EQ(m->base_colour, Rgb(0.6f, 0.1f, 0.1f));
  }
  EXPECT_EQ(read("")->base_colour, Rgb(0.7f)) << "no Kd: the fallback";
}

TEST(MtlMaterial, what_blender_writes_for_every_material_is_a_plain_gloss_of_four_per_cent) {
  const auto m =
      read("Ns 250.000000\nKa 1.0 1.0 1.0\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nKe 0 0 0\nNi 1.45\nd 1.0\nillum 2\n");
  ASSERT_TRUE(m) << m.error().message();
  EXPECT_EQ(m->metallic, 0.0f);
  EXPECT_EQ(m->transmission, 0.0f);
  EXPECT_NEAR(m->ior, 1.5f, 1e-5f) << "F0 = 0.08 Ks = 0.04";
  EXPECT_NEAR(m->roughness, std::pow(2.0 / 252.0, 0.25), 1e-6);
}

TEST(MtlMaterial, a_mirror_keeps_what_kd_and_ks_send_back) {
  const auto chrome = read("Kd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\n");
  EXPECT_EQ(chrome->metallic, 1.0f);
  EXPECT_EQ(chrome->roughness, 0.0f) << "no Ns: smooth";
  EXPECT_EQ(chrome->base_colour, Rgb(0.9f));
  const auto mixed = read("Kd 0.3 0.3 0.3\nKs 0.6 0.6 0.6\nNs 30\nillum 5\n");
  EXPECT_NEAR(mixed->metallic * mixed->base_colour.r, 0.6f, 1e-6f);
  EXPECT_NEAR((1.0f - mixed->metallic) * mixed->base_colour.r, 0.3f, 1e-6f);
  EXPECT_NEAR(mixed->roughness, 0.5f, 1e-6f) << "alpha 0.25";
  const auto much = read("Kd 0.8 0.8 0.8\nKs 0.8 0.8 0.8\nillum 3\n");
  EXPECT_EQ(much->base_colour, Rgb(1.0f)) << "never more than it gets";
  EXPECT_EQ(read("Ks 0.9 0.9 0.9\nNs 1000\nillum 3\nKd 0 0 0\n")->roughness, 0.0f);
}

TEST(MtlMaterial, keywords_that_are_not_read_are_named_unless_they_change_nothing) {
  const auto all = detail::parse_mtl_text(
      "newmtl paint\nKa 1 1 1\nKd 0.5 0.5 0.5\nRoughness 0.3\nPs 0.0\nmap_Kd\nmap_Bump -bm 1 a.png\nPs 0.4\n", "a.mtl");
  ASSERT_TRUE(all) << all.error().message();
  EXPECT_EQ(all->front().unread, (std::vector<std::string>{"Roughness", "map_Kd without a file", "map_Bump", "Ps"}));
}

TEST(MtlMaterial, an_illumination_model_is_a_whole_number_from_0_to_10) {
  for (const char* model : {"99", "7.5", "-1", "nan"}) {
    const auto m = read("Kd 0.5 0.5 0.5\nillum " + std::string(model) + "\n");
    EXPECT_FALSE(m) << model;
  }
  EXPECT_TRUE(read("Kd 0.5 0.5 0.5\nillum 10\n"));
}

TEST(MtlMaterial, glass_by_illum_and_by_d) {
  const auto glass = read("Kd 0 0 0\nKs 0.5 0.5 0.5\nNs 250\nNi 1.6\nTf 0.9 1 0.9\nillum 7\n");
  EXPECT_EQ(glass->transmission, 1.0f);
  EXPECT_FLOAT_EQ(glass->ior, 1.6f);
  EXPECT_EQ(glass->roughness, 0.0f) << "Ns is of highlights: glass is clear";
  EXPECT_EQ(glass->base_colour, Rgb(0.9f, 1.0f, 0.9f));
  EXPECT_FALSE(glass->thin);
  EXPECT_FLOAT_EQ(read("illum 6\n")->ior, 1.5f) << "no Ni: as KHR_materials_ior has it";
  const auto tinted = read("Kd 0.2 0.6 0.2\nd 0.25\nNi 1.5\nillum 9\n");
  EXPECT_FLOAT_EQ(tinted->transmission, 0.75f);
  EXPECT_EQ(tinted->base_colour, Rgb(0.2f, 0.6f, 0.2f));
  const auto veil = read("Kd 0.5 0.5 0.5\nTr 0.4\n");
  EXPECT_FLOAT_EQ(veil->transmission, 0.4f);
  EXPECT_EQ(veil->ior, 1.0f);
  EXPECT_TRUE(veil->thin) << "without Ni: light goes straight on";
  EXPECT_EQ(read("d 1\nTr 1\n")->transmission, 0.0f) << "d counts";
}

TEST(MtlMaterial, the_extension_for_physical_materials_wins) {
  const auto m =
      read("Kd 0.9 0.6 0.2\nKs 0.5 0.5 0.5\nNs 250\nillum 3\nPr 0.35\nPm 1\nPc 0.5\nPcr 0.1\naniso 0.4\nanisor 0.25\n"
           "Ke 2 1 0\n");
  ASSERT_TRUE(m) << m.error().message();
  EXPECT_FLOAT_EQ(m->roughness, 0.35f);
  EXPECT_EQ(m->metallic, 1.0f);
  EXPECT_EQ(m->base_colour, Rgb(0.9f, 0.6f, 0.2f));
  EXPECT_FLOAT_EQ(m->clearcoat, 0.5f);
  EXPECT_FLOAT_EQ(m->anisotropy, 0.4f);
  EXPECT_NEAR(m->anisotropy_rotation, 1.5707963f, 1e-6f);
  EXPECT_EQ(m->emission, Rgb(2.0f, 1.0f, 0.0f));
}

TEST(MtlMaterial, numbers_that_mean_nothing_are_errors) {
  for (const char* lines :
       {"Ns -5\n", "Ns nan\n", "Ns inf\n", "d 1.5\n", "Tr -1\n", "Pr -0.2\n", "Pr 1.2\n", "Pm nan\n", "Kd 1.6 0 0\n",
        "Ks 0 -1 0\n", "Ke -1 0 0\n", "Ke nan 0 0\n", "Ni 0.5\nillum 7\n", "Ni nan\nd 0.5\n", "Pc 3\n", "aniso 2\n"}) {
    const auto m = read(lines);
    ASSERT_FALSE(m) << lines;
    EXPECT_EQ(m.error().code, ErrorCode::value_invalid) << lines;
    EXPECT_NE(m.error().message().find("paint"), std::string::npos) << m.error().message();
  }
  EXPECT_FALSE(read("Pr rough\n")) << "no number";
}

} // namespace
} // namespace daylit
