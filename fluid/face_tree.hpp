// SPDX-License-Identifier: MIT
// A tree of boxes around the faces of walls: which faces a line may cross, and which may be the
// nearest, at a cost that grows with the logarithm of their number where faces are much finer than
// the points. What it leaves out is certain, so results are those of a test of every face.
//
// The nearest place of a face to a point is no local minimum of the distance over the surface
// unless the line between them lies between the normals of the faces that meet there. A box
// therefore carries a cone around the normals of its faces and of those next to them. Source: D. E.
// Johnson, E. Cohen, Proc. ACM Symp. Interactive 3D Graphics (2001) 129, "Spatialized normal cone
// hierarchies".
#pragma once

#include "fluid/wall_face.hpp"

#include <vector>

namespace sluice::fluid {

template <int dim> struct Walls;

template <int dim> class FaceTree {
public:
  /// Puts the boxes around the faces as they are. The tree is built for the first walls, and keeps
  /// its shape as these move; where they have not nothing is done.
  void update(const Walls<dim> &walls);

  /// Is test(face) true of one of the faces that come within `reach` [m] of x? Others may be asked.
  template <class Test> bool any_near(const Vec<dim> &x, double reach, Test &&test) const {
    return any([&](const Node &n) { return n.distance2(x) <= reach * reach; }, test);
  }

  /// Calls visit(face), in no order, for the faces within `reach` of x [m] that may hold a local
  /// minimum of the distance to x over the surface, and for some others.
  template <class Visit>
  void for_each_facing(const Vec<dim> &x, double reach, Visit &&visit) const {
    any(
        [&](const Node &n) {
          const double distance2 = n.distance2(x);
          return distance2 <= reach * reach && n.may_face(x, distance2);
        },
        [&](int face) {
          visit(face);
          return false;
        });
  }

  /// Is test(face) true of one of the faces whose box the line from `from` to `to` meets?
  template <class Test>
  bool any_along(const Vec<dim> &from, const Vec<dim> &to, Test &&test) const {
    const Line line{0.5 * (from + to), 0.5 * (to - from), (0.5 * (to - from)).cwiseAbs()};
    return any([&](const Node &n) { return n.meets(line); }, test);
  }

private:
  /// A straight line between two points: its middle, half the way from end to end, and the
  /// magnitudes of that.
  struct Line {
    Vec<dim> middle, half, extent;
  };

  struct FaceBox {
    Vec<dim> low, high; // [m]
    void widen(const FaceBox &other) {
      low = low.cwiseMin(other.low);
      high = high.cwiseMax(other.high);
    }
    // Length, or area, around it but for a factor: how often a line meets it.
    double measure() const {
      const Vec<dim> size = high - low;
      if constexpr (dim == 2)
        return size[0] + size[1];
      else
        return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    }
  };

  struct Node {
    Vec<dim> centre, half; // of the box, half its size [m]
    Vec<dim> axis;         // of the cone, of length one
    double angle;          // from the axis to the farthest normal [rad]
    double cos2;           // of that angle, squared, less what rounding may do; 0: no bound
    int begin, end;        // of its faces, in face_
    int next;              // the node after its descendants

    double distance2(const Vec<dim> &x) const {
      return ((x - centre).cwiseAbs() - half).cwiseMax(0).squaredNorm();
    }
    // Of a line from the box to x the part along the axis is at most that to the farthest corner.
    bool may_face(const Vec<dim> &x, double distance2) const {
      const double along = std::abs(axis.dot(x - centre)) + axis.cwiseAbs().dot(half);
      return along * along >= cos2 * distance2;
    }
    bool meets(const Line &line) const;
  };

  /// Goes through the tree, below those nodes alone that it enters, until test(face) is true.
  template <class Enters, class Test> bool any(Enters &&enters, Test &&test) const {
    for (int k = 0; k < static_cast<int>(nodes_.size());) {
      const Node &node = nodes_[k];
      if (!enters(node)) {
        k = node.next;
        continue;
      }
      if (node.next == ++k) // no descendants
        for (int f = node.begin; f < node.end; ++f)
          if (test(face_[f]))
            return true;
    }
    return false;
  }

  void build(const Walls<dim> &walls);
  void split(const std::vector<FaceBox> &box, int begin, int end);
  void fit_boxes(const Walls<dim> &walls);
  void fit_cones(const Walls<dim> &walls);

  std::vector<Node> nodes_; // depth first
  std::vector<int> face_;
  std::vector<Vec<dim>> position_; // of the vertices that the boxes are around [m]
  std::vector<Vec<dim>> normal_;   // of the faces
};

/// Separating axes: those of the box, and those across one of them and the line. Source: C.
/// Ericson, Real-Time Collision Detection (2005), section 5.3.3.
template <int dim> inline bool FaceTree<dim>::Node::meets(const Line &line) const {
  Vec<dim> c;
  for (int d = 0; d < dim; ++d) { // most boxes are apart along the first directions
    c[d] = line.middle[d] - centre[d];
    if (std::abs(c[d]) > half[d] + line.extent[d])
      return false;
  }
  const auto is_apart = [&](int a, int b) {
    return std::abs(line.half[a] * c[b] - line.half[b] * c[a]) >
           half[a] * line.extent[b] + half[b] * line.extent[a];
  };
  if constexpr (dim == 2)
    return !is_apart(0, 1);
  else
    return !is_apart(1, 2) && !is_apart(2, 0) && !is_apart(0, 1);
}

} // namespace sluice::fluid
