// Times overlap_volume() of the `overlap` header on the pairs of a file, and writes the volumes to another.
//
// Usage: peer_driver PAIRS VOLUMES REPEATS
// PAIRS: int64 count, int64 corners (4 or 8), then for each pair 3 + 1 + 3 * corners doubles: centre, radius,
// corners. VOLUMES: count doubles; NaN where the header throws. Standard output: two numbers, the median
// nanoseconds a pair of building the spheres and elements, and of overlap_volume() on the built ones.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <vector>

#include "overlap.hpp"

namespace {

using Clock = std::chrono::steady_clock;

double nanoseconds_each(Clock::time_point start, std::size_t count) {
  const std::chrono::duration<double, std::nano> elapsed = Clock::now() - start;
  return elapsed.count() / static_cast<double>(count);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template<typename Element, std::size_t Corners>
int run(const std::vector<double>& numbers, std::size_t count, int repeats, const char* path) {
  constexpr std::size_t stride = 4 + 3 * Corners;
  std::vector<double> building, overlapping, volumes(count);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    std::vector<overlap::Sphere> spheres;
    std::vector<Element> elements;
    spheres.reserve(count);
    elements.reserve(count);
    const auto before = Clock::now();
    for (std::size_t pair = 0; pair < count; ++pair) {
      const double* row = numbers.data() + pair * stride;
      std::array<overlap::Vector, Corners> corners;
      for (std::size_t corner = 0; corner < Corners; ++corner) {
        const double* at = row + 4 + 3 * corner;
        corners[corner] = overlap::Vector{at[0], at[1], at[2]};
      }
      spheres.emplace_back(overlap::Vector{row[0], row[1], row[2]}, row[3]);
      elements.emplace_back(corners);
    }
    building.push_back(nanoseconds_each(before, count));
    const auto start = Clock::now();
    for (std::size_t pair = 0; pair < count; ++pair) {
      try {
        volumes[pair] = overlap::overlap_volume(spheres[pair], elements[pair]);
      } catch (...) {
        volumes[pair] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    overlapping.push_back(nanoseconds_each(start, count));
  }
  std::ofstream output(path, std::ios::binary);
  output.write(reinterpret_cast<const char*>(volumes.data()), static_cast<std::streamsize>(count * sizeof(double)));
  std::printf("%.3f %.3f\n", median(building), median(overlapping));
  return output.good() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  std::ifstream input(argv[1], std::ios::binary);
  std::int64_t shape[2] = {0, 0};
  input.read(reinterpret_cast<char*>(shape), sizeof(shape));
  const auto count = static_cast<std::size_t>(shape[0]);
  std::vector<double> numbers(count * static_cast<std::size_t>(4 + 3 * shape[1]));
  input.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(double)));
  if (!input.good()) return 2;
  const int repeats = std::atoi(argv[3]);
  if (shape[1] == 4) return run<overlap::Tetrahedron, 4>(numbers, count, repeats, argv[2]);
  return run<overlap::Hexahedron, 8>(numbers, count, repeats, argv[2]);
}
