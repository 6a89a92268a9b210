# Vector code: Highway compiles a kernel for several instruction sets and chooses among them when the program runs.
# Link daylit_highway where a source includes <hwy/highway.h>.
find_package(hwy REQUIRED)
add_library(daylit_highway INTERFACE)
set_target_properties(daylit_highway PROPERTIES EXPORT_NAME highway)
target_link_libraries(daylit_highway INTERFACE hwy::hwy)
# Plain code, AVX2 and AVX-512 (AVX3) are left: each further one costs compile time, for processors older than 2013.
target_compile_definitions(daylit_highway INTERFACE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3_DL)")
