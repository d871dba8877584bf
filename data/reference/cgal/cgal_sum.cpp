// The Minkowski sum A ⊕ B, or with --difference A ⊖ B = {x : x + B ⊆ A}, by CGAL's Nef polyhedra, as one line of JSON.
// usage: cgal_sum [--difference] A.off B.off
//
// Coordinates are read as doubles and are exact from there on; volume, area and box are rounded once, at the end (the area
// is a sum of roots of doubles). A ⊖ B is what the sum of −B and A's complement leaves of a box. The complement is taken
// within a box wider than B all around A, since a sum of CGAL's is one of bounded solids.
// What CGAL will not do is printed as {"refused": reason}, never as a number.

#include "exact_mesh.h"

#include <CGAL/Nef_polyhedron_3.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/minkowski_sum_3.h>
#include <CGAL/version.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

using Nef = CGAL::Nef_polyhedron_3<Kernel>;
using Number = Kernel::FT;

// Lowest and highest x, y and z.
struct Box {
  std::array<Number, 3> low, high;
};

template <class Points>
Box box_of(const Points& points) {
  std::optional<Box> box;
  for (const Point& p : points) {
    if (!box) box = Box{{p.x(), p.y(), p.z()}, {p.x(), p.y(), p.z()}};
    for (int i = 0; i < 3; ++i) {
      box->low[i] = std::min(box->low[i], p[i]);
      box->high[i] = std::max(box->high[i], p[i]);
    }
  }
  if (!box) throw Refused("the result is empty");
  return *box;
}

Nef solid_of(const Box& box) {
  std::vector<Point> points;
  for (int i = 0; i < 8; ++i) {
    const auto side = [&](int axis) { return i >> axis & 1 ? box.high[axis] : box.low[axis]; };
    points.emplace_back(side(0), side(1), side(2));
  }
  const std::vector<std::array<std::size_t, 4>> faces = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                                         {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, faces, mesh);
  return Nef(mesh);
}

// Nef polyhedra are made of one shell each: of several, the inner ones would be lost. Where shells lie one in another,
// the larger is the outer.
Nef solid_of(const Mesh& mesh) {
  std::vector<Mesh> shells;
  PMP::split_connected_components(mesh, shells);
  const auto size = [](const Mesh& shell) { return CGAL::abs(PMP::volume(shell)); };
  std::sort(shells.begin(), shells.end(), [&](const Mesh& a, const Mesh& b) { return size(a) > size(b); });
  Nef solid;
  for (Mesh& shell : shells) {
    if (PMP::is_outward_oriented(shell)) {
      solid += Nef(shell);
    } else {
      PMP::reverse_face_orientations(shell);
      solid -= Nef(shell);
    }
  }
  return solid.regularization();
}

Mesh reflected(Mesh mesh) {
  for (const auto v : mesh.vertices()) mesh.point(v) = CGAL::ORIGIN - (mesh.point(v) - CGAL::ORIGIN);
  PMP::reverse_face_orientations(mesh);
  return mesh;
}

Nef sum(const Mesh& a, const Mesh& b) {
  Nef solids[] = {solid_of(a), solid_of(b)};
  return CGAL::minkowski_sum_3(solids[0], solids[1]);
}

Nef difference(const Mesh& a, const Mesh& b) {
  const Box box_a = box_of(a.points()), box_b = box_of(b.points());
  Box room = box_a, answer;
  for (int i = 0; i < 3; ++i) {
    const Number width = box_b.high[i] - box_b.low[i] + 1;
    room.low[i] -= width;
    room.high[i] += width;
    // Where x + B lies in the room.
    answer.low[i] = room.low[i] - box_b.low[i];
    answer.high[i] = room.high[i] - box_b.high[i];
  }
  Nef outside = (solid_of(room) - solid_of(a)).regularization();
  Nef tool = solid_of(reflected(b));
  return solid_of(answer) - CGAL::minkowski_sum_3(outside, tool);
}

// Twice the area of a facet, as a vector along its normal, and a point of it. Boundaries of holes turn the other way.
std::pair<Rationals, Rationals> area_and_point(Nef::Halffacet_const_iterator facet) {
  Rationals area{0, 0, 0};
  std::optional<Rationals> point;
  for (auto cycle = facet->facet_cycles_begin(); cycle != facet->facet_cycles_end(); ++cycle) {
    if (!cycle.is_shalfedge()) continue;
    const Nef::SHalfedge_const_handle first(cycle);
    auto edge = first;
    do {
      const Rationals a = exact(edge->source()->source()->point());
      const Rationals term = cross(a, exact(edge->next()->source()->source()->point()));
      for (int i = 0; i < 3; ++i) area[i] += term[i];
      if (!point) point = a;
      edge = edge->next();
    } while (edge != first);
  }
  if (!point) throw std::runtime_error("a facet without a boundary");
  return {area, *point};
}

std::string json(const std::array<Number, 3>& point) {
  std::string text = "[";
  for (int i = 0; i < 3; ++i) text += (i ? ", " : "") + number(exact({point[i], 0, 0})[0].get_d());
  return text + "]";
}

std::string describe(const Nef& solid) {
  RationalSum volume;
  double area = 0;
  for (auto facet = solid.halffacets_begin(); facet != solid.halffacets_end(); ++facet) {
    // Of the two sides of a facet the one that looks into the solid.
    if (!facet->incident_volume()->mark()) continue;
    const auto [twice, point] = area_and_point(facet);
    volume.add(-dot(twice, point));
    area += std::sqrt(dot(twice, twice).get_d()) / 2;
  }
  int components = 0, voids = 0;
  for (auto part = solid.volumes_begin(); part != solid.volumes_end(); ++part) {
    ++(part->mark() ? components : voids);
  }
  std::vector<Point> points;
  for (auto vertex = solid.vertices_begin(); vertex != solid.vertices_end(); ++vertex) {
    points.push_back(vertex->point());
  }
  const Box box = box_of(points);
  return "\"volume\": " + number(volume.over(6)) + ", \"area\": " + number(area) + ", \"box\": [" + json(box.low) + ", " +
         json(box.high) + "], \"components\": " + std::to_string(components) +
         ", \"cavities\": " + std::to_string(voids - 1);
}

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words == std::vector<std::string>{"--version"}) {
    std::cout << CGAL_VERSION_STR << "\n";
    return 0;
  }
  const bool less = !words.empty() && words[0] == "--difference";
  if (words.size() != (less ? 3 : 2)) {
    std::cerr << "usage: cgal_sum [--difference] A.off B.off\n";
    return 2;
  }
  std::string answer;
  try {
    const Mesh a = read_off(words[words.size() - 2]), b = read_off(words[words.size() - 1]);
    check_input(a, "A");
    check_input(b, "B");
    answer = describe((less ? difference(a, b) : sum(a, b)).regularization());
  } catch (const CGAL::Failure_exception& e) {
    answer = "\"volume\": " + refusal("CGAL: " + e.message());
  } catch (const Refused& e) {
    answer = "\"volume\": " + refusal(e.what());
  }
  std::cout << "{\"version\": \"" << CGAL_VERSION_STR << "\", " << answer << "}\n";
}
