// SPDX-License-Identifier: MIT
// Nearest face of an interface mesh: a binary tree of bounding boxes, built once. A query costs
// O(log n) boxes. Equal distances go to the lowest face number, so that the result does not depend
// on the tree.
#pragma once

#include "bridge/interface_mesh.hpp"
#include "bridge/projection.hpp"

#include <Eigen/Geometry>

#include <vector>

namespace sluice::bridge {

class FaceTree {
public:
  explicit FaceTree(const InterfaceMesh &mesh);

  struct Nearest {
    std::size_t face = 0;
    Projection projection;
  };
  /// `p` has three components; the third is zero in 2-D.
  Nearest nearest(const Vec<3> &p) const;

  /// Numbers of the faces whose bounding boxes meet `box`, in no order that means anything.
  using Box = Eigen::AlignedBox3d;
  void find(const Box &box, std::vector<std::size_t> &faces) const;

private:
  struct Branch {
    Box box;
    std::size_t first, last; // faces order_[first..last)
    std::size_t children;    // index of the first of two; 0: a leaf
  };
  void build(std::size_t branch);
  void search(std::size_t branch, const Vec<3> &p, Nearest &best) const;
  Box box_of(std::size_t face) const;
  Projection project(const Vec<3> &p, std::size_t face) const;

  const InterfaceMesh &mesh_;
  std::vector<std::size_t> order_;
  std::vector<Branch> branches_;
};

} // namespace sluice::bridge
