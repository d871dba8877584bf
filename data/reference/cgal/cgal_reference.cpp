// The volumes of A, B, A ∩ B, A ∪ B and A − B by CGAL's corefinement with an exact kernel, as one line of JSON.
// usage: cgal_reference A.off B.off
//
// Coordinates are read as doubles and are exact from there on: intersection points are rationals, and only the finished
// volume is rounded to a double. What CGAL will not do is printed as {"refused": reason}, never as a number.

#include "exact_mesh.h"

#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/version.h>
#include <boost/optional.hpp>

#include <iostream>

double volume(const Mesh& mesh) {
  RationalSum sum;
  for (const auto face : mesh.faces()) {
    const auto h = mesh.halfedge(face);
    const auto corner = [&](Mesh::Vertex_index v) { return exact(mesh.point(v)); };
    sum.add(dot(corner(mesh.source(h)), cross(corner(mesh.target(h)), corner(mesh.target(mesh.next(h))))));
  }
  return sum.over(6);
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
