// The volumes of A, B, A ∩ B, A ∪ B and A − B by CGAL's corefinement with an exact kernel, as one line of JSON.
// usage: cgal_reference A.off B.off
//
// Coordinates are read as doubles and are exact from there on: intersection points are rationals, and only the finished
// volume is rounded to a double. What CGAL will not do is printed as {"refused": reason}, never as a number.

// The exact number type is then mpq_class, whichever way CGAL was found.
#ifndef CGAL_USE_GMPXX
#define CGAL_USE_GMPXX 1
#endif

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>
#include <boost/optional.hpp>
#include <gmpxx.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Mesh read_off(const std::string& path) {
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

void check_input(const Mesh& mesh, const std::string& name) {
  if (!CGAL::is_closed(mesh)) throw Refused(name + " is not closed");
  if (PMP::does_self_intersect(mesh)) throw Refused(name + " intersects itself");
  if (!PMP::does_bound_a_volume(mesh)) throw Refused(name + " does not bound a volume");
}

// Each face's term is an exact rational. Their plain sum would carry the product of all denominators, so the terms are
// added in fixed point with 1024 binary places: off by less than faces × 2^-1024, far below the last place of a double.
double volume(const Mesh& mesh) {
  constexpr unsigned places = 1024;
  const auto exact = [&](Mesh::Vertex_index v) {
    const Point& p = mesh.point(v);
    return std::array<mpq_class, 3>{CGAL::exact(p.x()), CGAL::exact(p.y()), CGAL::exact(p.z())};
  };
  mpz_class sum = 0;
  for (const auto face : mesh.faces()) {
    const auto h = mesh.halfedge(face);
    const auto a = exact(mesh.source(h)), b = exact(mesh.target(h)), c = exact(mesh.target(mesh.next(h)));
    mpq_class term = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                     a[2] * (b[0] * c[1] - b[1] * c[0]);
    term <<= places;
    sum += term.get_num() / term.get_den();
  }
  if (abs(sum) <= mesh.number_of_faces()) return 0.0;
  mpq_class result(sum);
  result >>= places;
  return mpq_class(result / 6).get_d();
}

std::string refusal(const std::string& reason) {
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

std::string number(double x) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.17g", x);
  return text.data();
}

// intersection, union, difference, volume of A, volume of B; empty until known
using Fields = std::array<std::string, 5>;

void refuse_rest(Fields& fields, const std::string& reason) {
  for (auto& field : fields) {
    if (field.empty()) field = refusal(reason);
  }
}

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--version") {
    std::cout << CGAL_VERSION_STR << "\n";
    return 0;
  }
  if (argc != 3) {
    std::cerr << "usage: cgal_reference A.off B.off\n";
    return 2;
  }
  Fields fields;
  try {
    Mesh a = read_off(argv[1]);
    Mesh b = read_off(argv[2]);
    check_input(a, "A");
    check_input(b, "B");
    fields[3] = number(volume(a));
    fields[4] = number(volume(b));

    Mesh common, joined, less;
    std::array<boost::optional<Mesh*>, 4> out;
    out[PMP::Corefinement::INTERSECTION] = &common;
    out[PMP::Corefinement::UNION] = &joined;
    out[PMP::Corefinement::TM1_MINUS_TM2] = &less;
    const auto done = PMP::corefine_and_compute_boolean_operations(
        a, b, out, PMP::parameters::throw_on_self_intersection(true));
    const auto field = [&](PMP::Corefinement::Boolean_operation_type op, const Mesh& mesh) {
      return done[op] ? number(volume(mesh)) : refusal("the result is not a two-manifold");
    };
    fields[0] = field(PMP::Corefinement::INTERSECTION, common);
    fields[1] = field(PMP::Corefinement::UNION, joined);
    fields[2] = field(PMP::Corefinement::TM1_MINUS_TM2, less);
  } catch (const CGAL::Failure_exception& e) {
    refuse_rest(fields, "CGAL: " + e.message());
  } catch (const PMP::Corefinement::Self_intersection_exception&) {
    refuse_rest(fields, "corefinement met a self-intersection");
  } catch (const Refused& e) {
    refuse_rest(fields, e.what());
  }
  std::cout << "{\"version\": \"" << CGAL_VERSION_STR << "\", \"intersection\": " << fields[0]
            << ", \"union\": " << fields[1] << ", \"difference\": " << fields[2] << ", \"volume_a\": " << fields[3] << ", \"volume_b\": " << fields[4]
            << "}\n";
}
