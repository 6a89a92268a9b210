#include "runtime/session/choose_renderer.h"

#include "runtime/trace/traced_renderer.h"

namespace daylit {

namespace {

Result<std::unique_ptr<PictureRenderer>> make_rays(const Room& room, std::span<const Aperture> apertures,
                                                   bool share = true) {
  auto made = TracedRenderer::make(room, apertures, {share});
  if (!made)
    return made.error();
  return std::unique_ptr<PictureRenderer>(std::make_unique<TracedRenderer>(std::move(*made)));
}

} // namespace

Result<std::unique_ptr<PictureRenderer>> choose_renderer(Backend backend, const Room& room,
                                                         std::span<const Aperture> apertures,
                                                         std::vector<std::string>& notes,
                                                         const RenderSettings& settings) {
  if (backend == Backend::rays || backend == Backend::rays_reference)
    return make_rays(room, apertures, backend == Backend::rays);
  const bool may_fall_back = backend == Backend::automatic;
  auto context = create_gl_context(backend == Backend::osmesa   ? GlBackend::osmesa
                                   : backend == Backend::window ? GlBackend::window
                                                                : GlBackend::egl);
  if (!context) {
    if (!may_fall_back)
      return context.error();
    notes.push_back("no OpenGL (" + context.error().what + "): rays on the processor draw the picture");
    return make_rays(room, apertures);
  }
  auto made = Renderer::make(std::move(*context), room, apertures, settings);
  if (!made && !may_fall_back)
    return made.error();
  if (!made)
    notes.push_back("OpenGL does not draw (" + made.error().what + "): rays on the processor do");
  if (!made || (may_fall_back && made->is_software()))
    return make_rays(room, apertures);
  return std::unique_ptr<PictureRenderer>(std::make_unique<Renderer>(std::move(*made)));
}

} // namespace daylit
