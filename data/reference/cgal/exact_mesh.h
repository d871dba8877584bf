// What the programs here share: meshes of exact coordinates, sums of rationals, and answers as JSON.

#pragma once

// The exact number type is then mpq_class, whichever way CGAL was found.
#ifndef CGAL_USE_GMPXX
#define CGAL_USE_GMPXX 1
#endif

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <gmpxx.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Rationals = std::array<mpq_class, 3>;

struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline Mesh read_off(const std::string& path) {
  std::ifstream file(path);
  std::string word;
  std::size_t points_count = 0, faces_count = 0, edges_count = 0;
  if (!(file >> word >> points_count >> faces_count >> edges_count) || word != "OFF") {
    throw std::runtime_error(path + ": not an OFF file");
  }
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> faces(faces_count);
  for (std::size_t i = 0; i < points_count; ++i) {
    std::array<double, 3> p;
    for (double& x : p) {
      // strtod rounds correctly, which operator>> of a stream does not promise.
      file >> word;
      x = std::strtod(word.c_str(), nullptr);
    }
    points.emplace_back(p[0], p[1], p[2]);
  }
  for (auto& face : faces) {
    std::size_t corners = 0;
    file >> corners >> face[0] >> face[1] >> face[2];
    if (corners != 3) throw std::runtime_error(path + ": a face that is not a triangle");
  }
  if (!file) throw std::runtime_error(path + ": cut short");
  if (!PMP::is_polygon_soup_a_polygon_mesh(faces)) {
    throw Refused("not a two-manifold: more than two faces at an edge, or faces that disagree on it");
  }
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, faces, mesh);
  return mesh;
}

inline void check_input(const Mesh& mesh, const std::string& name) {
  if (!CGAL::is_closed(mesh)) throw Refused(name + " is not closed");
  if (PMP::does_self_intersect(mesh)) throw Refused(name + " intersects itself");
  if (!PMP::does_bound_a_volume(mesh)) throw Refused(name + " does not bound a volume");
}

inline Rationals exact(const Point& p) { return {CGAL::exact(p.x()), CGAL::exact(p.y()), CGAL::exact(p.z())}; }

inline Rationals cross(const Rationals& a, const Rationals& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline mpq_class dot(const Rationals& a, const Rationals& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A plain sum of exact rationals would carry the product of all denominators, so terms are added in fixed point with
// 1024 binary places: off by less than terms × 2^-1024, far below the last place of a double.
class RationalSum {
 public:
  void add(mpq_class term) {
    term <<= places;
    sum += term.get_num() / term.get_den();
    ++terms;
  }

  // The sum over a divisor, rounded once.
  double over(int divisor) const {
    if (abs(sum) <= terms) return 0.0;
    mpq_class result(sum);
    result >>= places;
    return mpq_class(result / divisor).get_d();
  }

 private:
  static constexpr unsigned places = 1024;
  mpz_class sum = 0;
  unsigned long terms = 0;
};

inline std::string refusal(const std::string& reason) {
  std::string text = "{\"refused\": \"";
  for (const char c : reason) {
    if (c == '\n') {
      text += ' ';
    } else {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
  }
  return text + "\"}";
}

inline std::string number(double x) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.17g", x);
  return text.data();
}
