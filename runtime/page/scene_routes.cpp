#include "runtime/page/scene_routes.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "runtime/page/scene_json.h"
#include "scene/core/text_lines.h"
#include "scene/image/image_formats.h"

namespace daylit {

namespace {

using Json = nlohmann::json;

HttpReply json_reply(std::string text) { return {200, "application/json", std::move(text)}; }

HttpReply failed(const Error& e) {
  const int status = e.code == ErrorCode::not_found ? 404 : e.code == ErrorCode::device ? 503 : 400;
  return {status, "application/json",
          Json{{"error", e.message()}}.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

HttpReply reply_of(const Result<void>& done) { return done ? json_reply("{}") : failed(done.error()); }

Error bad(const std::string& what) { return {ErrorCode::usage, what, "", "load the page again"}; }

/// What a change says; null where it is no object.
Json parse(const HttpRequest& request) {
  Json json = Json::parse(request.body, nullptr, false);
  return json.is_object() ? json : Json();
}

/// N finite numbers of a key.
template <class V>
std::optional<V> vector_of(const Json& json, const char* key) {
  V v(0.0);
  const auto at = json.find(key);
  if (at == json.end() || !at->is_array() || at->size() != static_cast<std::size_t>(v.length()))
    return std::nullopt;
  for (int k = 0; k < v.length(); ++k) {
    const Json& number = (*at)[static_cast<std::size_t>(k)];
    if (!number.is_number() || !std::isfinite(number.get<double>()))
      return std::nullopt;
    v[k] = number.get<double>();
  }
  return v;
}

/// What a key must be, if it is there.
struct Field {
  std::string_view key, kind; ///< kind: "a number", "true or false", "2 numbers", "3 numbers", "an index"
};

bool is_of_kind(const Json& value, std::string_view kind) {
  const auto numbers = [&](std::size_t n) {
    return value.is_array() && value.size() == n &&
           std::ranges::all_of(value, [](const Json& v) { return v.is_number() && std::isfinite(v.get<double>()); });
  };
  return kind == "a number"        ? value.is_number()
         : kind == "true or false" ? value.is_boolean()
         : kind == "an index"      ? value.is_number_unsigned()
                                   : numbers(kind == "2 numbers" ? 2 : 3);
}

/// Error: it is no object, holds a key that is not meant, or one of another kind.
Result<void> check(const Json& json, std::initializer_list<Field> fields) {
  if (!json.is_object())
    return bad("a change is a JSON object");
  for (const auto& [key, value] : json.items()) {
    const auto* field = std::ranges::find(fields, std::string_view(key), &Field::key);
    if (field == fields.end())
      return bad("unknown key \"" + key.substr(0, 40) + "\"");
    if (!is_of_kind(value, field->kind))
      return bad("\"" + key + "\" must be " + std::string(field->kind));
  }
  return {};
}

std::optional<std::size_t> index_of(const Json& json, const char* key) {
  const auto at = json.find(key);
  return at != json.end() && at->is_number_unsigned() ? std::optional(at->get<std::size_t>()) : std::nullopt;
}

HttpReply change(SceneEditor& editor, const HttpRequest& request) {
  const Json json = parse(request);
  if (const auto sound = check(json, {{"object", "an index"},
                                      {"position", "3 numbers"},
                                      {"rotation", "3 numbers"},
                                      {"scale", "a number"},
                                      {"pixel", "2 numbers"},
                                      {"grip", "2 numbers"}});
      !sound)
    return failed(sound.error());
  const auto object = index_of(json, "object");
  if (!object)
    return failed(bad("a change names its object"));
  ObjectChange change;
  change.position = vector_of<glm::dvec3>(json, "position");
  change.rotation_deg = vector_of<glm::dvec3>(json, "rotation");
  change.pixel = vector_of<glm::dvec2>(json, "pixel");
  if (const auto scale = json.find("scale"); scale != json.end() && scale->is_number())
    change.scale = scale->get<double>();
  change.grip_m = vector_of<glm::dvec2>(json, "grip").value_or(glm::dvec2(0.0));
  return reply_of(editor.change(*object, change));
}

HttpReply add(SceneEditor& editor, const HttpRequest& request) {
  const Json json = parse(request);
  if (const auto sound = check(json, {{"model", "an index"}, {"position", "3 numbers"}}); !sound)
    return failed(sound.error());
  const auto model = index_of(json, "model");
  const auto position = vector_of<glm::dvec3>(json, "position");
  return model && position ? reply_of(editor.add(*model, *position))
                           : failed(bad("a new object has a model and a position"));
}

HttpReply remove(SceneEditor& editor, const HttpRequest& request) {
  const Json json = parse(request);
  if (const auto sound = check(json, {{"object", "an index"}}); !sound)
    return failed(sound.error());
  const auto object = index_of(json, "object");
  return object ? reply_of(editor.remove(*object)) : failed(bad("name the object"));
}

HttpReply pick(SceneEditor& editor, const HttpRequest& request) {
  const auto number = [&](const char* key) {
    const auto at = request.query.find(key);
    return at == request.query.end() ? std::nullopt : parse_number(at->second);
  };
  const auto x = number("x"), y = number("y");
  if (!x || !y || !std::isfinite(*x) || !std::isfinite(*y))
    return failed(bad("a pixel is x and y"));
  const auto picked = editor.pick({*x, *y});
  if (!picked)
    return failed(picked.error());
  return json_reply(
      *picked ? Json{{"object", (*picked)->object}, {"grip", {(*picked)->grip_m.x, (*picked)->grip_m.y}}}.dump()
              : Json{{"object", nullptr}}.dump());
}

HttpReply show(SceneEditor& editor, const HttpRequest& request) {
  const Json json = parse(request);
  if (const auto sound =
          check(json, {{"direct", "true or false"}, {"indirect", "true or false"}, {"differential", "true or false"}});
      !sound)
    return failed(sound.error());
  ShownParts parts = editor.shown();
  for (const auto& [key, part] :
       {std::pair{"direct", &parts.direct}, {"indirect", &parts.indirect}, {"differential", &parts.differential}})
    if (const auto at = json.find(key); at != json.end() && at->is_boolean())
      *part = at->get<bool>();
  return reply_of(editor.show(parts));
}

/// Text made of the session between two frames.
template <class Make>
HttpReply made_between_frames(SessionDesk& desk, const Make& make) {
  std::string text;
  const auto asked = desk.ask([&](const BetweenFrames& now) -> Result<void> {
    text = make(now);
    return {};
  });
  return asked ? json_reply(std::move(text)) : failed(asked.error());
}

/// Before the first sky: null.
HttpReply made_under_sky(SessionDesk& desk, std::string (*make)(const Session&, const SkyImage&)) {
  return made_between_frames(desk,
                             [&](const BetweenFrames& now) { return now.sky ? make(now.session, *now.sky) : "null"; });
}

/// Exposed so that all but the brightest fiftieth is below white. Only the copy is made between frames.
HttpReply sky_picture(SessionDesk& desk) {
  RgbImage sky;
  const auto asked = desk.ask([&](const BetweenFrames& now) -> Result<void> {
    if (now.sky)
      sky = now.sky->image();
    return {};
  });
  if (!asked)
    return failed(asked.error());
  std::vector<float> brightest;
  for (const Rgb& c : sky.texels)
    if (const float most = std::max({c.r, c.g, c.b}); most > 0.0f)
      brightest.push_back(most);
  if (brightest.empty())
    return failed({ErrorCode::not_found, "there is no sky yet", "", "wait for the sky camera"});
  const auto white = brightest.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(brightest.size() - 1));
  std::nth_element(brightest.begin(), white, brightest.end());
  const auto jpeg = encoded_jpeg(to_srgb8(sky, 1.0f / *white));
  return jpeg ? HttpReply{200, "image/jpeg", std::string(jpeg->begin(), jpeg->end())} : failed(jpeg.error());
}

} // namespace

std::vector<HttpRoute> scene_routes(SessionDesk& desk, SceneEditor& editor) {
  using Method = HttpRoute::Method;
  return {
      {Method::get, "/scene",
       [&desk, &editor](const HttpRequest&) {
         return made_between_frames(desk, [&](const BetweenFrames& now) {
           return objects_json(now.session, editor.shown(), editor.models());
         });
       }},
      {Method::get, "/scene/room",
       [&desk](const HttpRequest&) {
         return made_between_frames(desk, [](const BetweenFrames& now) { return room_json(now.session); });
       }},
      {Method::get, "/scene/light", [&desk](const HttpRequest&) { return made_under_sky(desk, light_json); }},
      {Method::get, "/scene/regions", [&desk](const HttpRequest&) { return made_under_sky(desk, regions_json); }},
      {Method::get, "/scene/sky.jpg", [&desk](const HttpRequest&) { return sky_picture(desk); }},
      {Method::get, "/scene/pick", [&editor](const HttpRequest& request) { return pick(editor, request); }},
      {Method::post, "/scene/change", [&editor](const HttpRequest& request) { return change(editor, request); }},
      {Method::post, "/scene/add", [&editor](const HttpRequest& request) { return add(editor, request); }},
      {Method::post, "/scene/remove", [&editor](const HttpRequest& request) { return remove(editor, request); }},
      {Method::post, "/scene/show", [&editor](const HttpRequest& request) { return show(editor, request); }},
      {Method::post, "/scene/save", [&editor](const HttpRequest&) { return reply_of(editor.save()); }},
  };
}

} // namespace daylit
