#include "runtime/page/page_files.h"

#include <string>

#include "runtime/page/page_text.h"

namespace daylit {

std::vector<HttpRoute> page_files() {
  struct File {
    const char *path, *type, *text;
  };
  constexpr const char *kHtml = "text/html; charset=utf-8", *kCss = "text/css; charset=utf-8",
                       *kScript = "text/javascript; charset=utf-8";
  std::vector<HttpRoute> routes;
  for (const File& file :
       {File{"/", kHtml, page_text::index}, File{"/style.css", kCss, page_text::style},
        File{"/main.js", kScript, page_text::main}, File{"/api.js", kScript, page_text::api},
        File{"/scene.js", kScript, page_text::scene}, File{"/picture.js", kScript, page_text::picture},
        File{"/panels.js", kScript, page_text::panels}, File{"/room.js", kScript, page_text::room},
        File{"/three.js", kScript, page_text::three}})
    routes.push_back({HttpRoute::Method::get, file.path, [file](const HttpRequest&) {
                        return HttpReply{200, file.type, file.text};
                      }});
  return routes;
}

} // namespace daylit
