#include "runtime/session/choose_renderer.h"

#include "runtime/trace/traced_renderer.h"

namespace daylit {

namespace {

Result<std::unique_ptr<PictureRenderer>> make_rays(const Room& room, std::span<const Aperture> apertures, bool share) {
  auto made = TracedRenderer::make(room, apertures, {share});
  if (!made)
    return made.error();
  return std::unique_ptr<PictureRenderer>(std::make_unique<TracedRenderer>(std::move(*made)));
}

} // namespace

Result<std::unique_ptr<PictureRenderer>> choose_renderer(Backend backend, const Room& room,
                                                         std::span<const Aperture> apertures,
                                                         const RenderSettings& settings) {
  if (backend == Backend::rays || backend == Backend::rays_reference)
    return make_rays(room, apertures, backend == Backend::rays);
  auto context = create_gl_context(backend == Backend::osmesa   ? GlBackend::osmesa
                                   : backend == Backend::window ? GlBackend::window
                                                                : GlBackend::egl);
  if (!context)
    return context.error();
  auto made = Renderer::make(std::move(*context), room, apertures, settings);
  if (!made)
    return made.error();
  return std::unique_ptr<PictureRenderer>(std::make_unique<Renderer>(std::move(*made)));
}

} // namespace daylit
