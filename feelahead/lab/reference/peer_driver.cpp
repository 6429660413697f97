// Times overlap_volume() of the `overlap` header on the pairs of a file, and writes the volumes to another.
//
// Usage: peer_driver PAIRS VOLUMES REPEATS
// PAIRS: int64 count, int64 corners (4 or 8), then for each pair 3 + 1 + 3 * corners doubles: centre, radius,
// corners. VOLUMES: count doubles; NaN where the header throws. Standard output: two lines with a number for each part
// of 128 pairs, the least nanoseconds of building its spheres and elements, and of overlap_volume() on the built ones.

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

constexpr std::size_t at_once = 128;

void keep_least(double& least, Clock::time_point start) {
  const std::chrono::duration<double, std::nano> elapsed = Clock::now() - start;
  least = std::min(least, elapsed.count());
}

void print(const std::vector<double>& numbers) {
  for (const double number : numbers) std::printf("%.1f ", number);
  std::printf("\n");
}

template<typename Element, std::size_t Corners>
int run(const std::vector<double>& numbers, std::size_t count, int repeats, const char* path) {
  constexpr std::size_t stride = 4 + 3 * Corners;
  const std::size_t parts = (count + at_once - 1) / at_once;
  const double never = std::numeric_limits<double>::infinity();
  std::vector<double> building(parts, never), overlapping(parts, never), volumes(count);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t first = part * at_once, last = std::min(count, first + at_once);
      std::vector<overlap::Sphere> spheres;
      std::vector<Element> elements;
      spheres.reserve(at_once);
      elements.reserve(at_once);
      const auto before = Clock::now();
      for (std::size_t pair = first; pair < last; ++pair) {
        const double* row = numbers.data() + pair * stride;
        std::array<overlap::Vector, Corners> corners;
        for (std::size_t corner = 0; corner < Corners; ++corner) {
          const double* at = row + 4 + 3 * corner;
          corners[corner] = overlap::Vector{at[0], at[1], at[2]};
        }
        spheres.emplace_back(overlap::Vector{row[0], row[1], row[2]}, row[3]);
        elements.emplace_back(corners);
      }
      keep_least(building[part], before);
      const auto start = Clock::now();
      for (std::size_t pair = first; pair < last; ++pair) {
        try {
          volumes[pair] = overlap::overlap_volume(spheres[pair - first], elements[pair - first]);
        } catch (...) {
          volumes[pair] = std::numeric_limits<double>::quiet_NaN();
        }
      }
      keep_least(overlapping[part], start);
    }
  }
  std::ofstream output(path, std::ios::binary);
  output.write(reinterpret_cast<const char*>(volumes.data()), static_cast<std::streamsize>(count * sizeof(double)));
  print(building);
  print(overlapping);
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
