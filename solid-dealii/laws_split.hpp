// SPDX-License-Identifier: MIT
// Laws of rubber, nearly incompressible: an energy of the distortion and one of the volume,
//
//   W = W_iso(F J^-1/3) + K/4 (J^2 - 1 - 2 ln J)
//
// Distortion by invariants I1 = tr bbar, I2 = (I1^2 - tr bbar^2)/2 of bbar = J^-2/3 b (neo-Hookean,
// Mooney-Rivlin, Yeoh), or by principal stretches (Ogden). A new law of invariants is one class
// with `energy` and its derivatives; a new split law one with `energy` and `distortion`.
//
// Sources: volume term and stress, tangent of the split: J. C. Simo, R. L. Taylor, Comput. Methods
// Appl. Mech. Engrg. 85 (1991) 273; the same by invariants: G. A. Holzapfel, Nonlinear Solid
// Mechanics (2000), sections 6.4 to 6.6. M. Mooney, J. Appl. Phys. 11 (1940) 582; O. H. Yeoh,
// Rubber Chem. Technol. 66 (1993) 754; R. W. Ogden, Proc. R. Soc. A 326 (1972) 565.
#pragma once

#include "solid-dealii/laws.hpp"

#include <Eigen/Eigenvalues>

#include <array>
#include <vector>

namespace sluice::solid {

/// U = K/4 (J^2 - 1 - 2 ln J), shared by every split law: convex, without bound at J = 0.
struct Volume {
  double bulk = 0; ///< K [Pa]

  template <class Number> Number energy(const Number &j) const {
    using std::log;
    return 0.25 * bulk * (j * j - 1.0 - 2.0 * log(j));
  }
  double pressure(double j) const { return 0.5 * bulk * (j - 1 / j); }        ///< U' [Pa], tension
  double stiffness(double j) const { return 0.5 * bulk * (1 + 1 / (j * j)); } ///< U'' [Pa]

  /// Adds J p I and its tangent to a response.
  template <int dim> void add_to(VoigtResponse<dim> &r, double j) const {
    add_pressure<dim>(r, j * pressure(j), j * j * stiffness(j));
  }
  /// The same for a Kirchhoff pressure J p [Pa] and J^2 U'' [Pa] from elsewhere.
  template <int dim>
  static void add_pressure(VoigtResponse<dim> &r, double kirchhoff, double stiffness) {
    r.stress.diagonal().array() += kirchhoff;
    r.carried.diagonal().array() += kirchhoff;
    r.tangent.template topLeftCorner<dim, dim>().array() += kirchhoff + stiffness;
    r.tangent.diagonal().template head<dim>().array() -= 2 * kirchhoff;
    r.tangent.diagonal().template tail<voigt_size<dim> - dim>().array() -= kirchhoff;
  }
};

/// First and second derivatives of W_iso with respect to I1 and I2 [Pa].
struct InvariantSlopes {
  double w1 = 0, w2 = 0, w11 = 0, w12 = 0, w22 = 0;
};

/// W_iso = c10 (I1 - 3) + c01 (I2 - 3); c01 = 0 is the neo-Hookean law.
struct MooneyRivlinEnergy {
  double c10 = 0, c01 = 0; ///< [Pa]
  template <class Number> Number energy(const Number &i1, const Number &i2) const {
    return c10 * (i1 - 3.0) + c01 * (i2 - 3.0);
  }
  InvariantSlopes slopes(double, double) const { return {c10, c01}; }
  double shear_modulus() const { return 2 * (c10 + c01); } ///< of small strains [Pa]
};

/// W_iso = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3.
struct YeohEnergy {
  double c10 = 0, c20 = 0, c30 = 0; ///< [Pa]
  template <class Number> Number energy(const Number &i1, const Number &) const {
    const Number x = i1 - 3.0;
    return x * (c10 + x * (c20 + x * c30));
  }
  InvariantSlopes slopes(double i1, double) const {
    const double x = i1 - 3;
    return {c10 + x * (2 * c20 + x * 3 * c30), 0, 2 * c20 + 6 * c30 * x};
  }
  double shear_modulus() const { return 2 * c10; } ///< of small strains [Pa]
};

/// A law of the invariants of bbar.
template <class Energy> struct InvariantLaw {
  Energy isochoric;
  Volume volume;

  /// Strain energy per reference volume [J/m^3].
  template <class Number> Number energy(const Eigen::Matrix<Number, 3, 3> &F) const {
    using std::pow;
    const Invariants<Number> i(F);
    const Number scale = pow(i.j, -2.0 / 3.0);
    const Number i1 = scale * i.b;
    const Number i2 = 0.5 * scale * scale * (i.b * i.b - i.bb);
    return isochoric.energy(i1, i2) + volume.energy(i.j);
  }

  /// Response of the distortion alone.
  VoigtResponse<3> distortion(const Mat<3> &F) const {
    using Voigt = Eigen::Matrix<double, 6, 1>;
    const Mat<3> one = Mat<3>::Identity();
    const Mat<3> b = std::pow(F.determinant(), -2.0 / 3.0) * F * F.transpose();
    const Mat<3> bb = b * b;
    const double i1 = b.trace(), i2 = 0.5 * (i1 * i1 - bb.trace());
    const InvariantSlopes s = isochoric.slopes(i1, i2);

    // Fictitious stress and tangent at fixed volume, Holzapfel (6.116) and (6.194) pushed forward.
    const Mat<3> fictitious = 2 * ((s.w1 + i1 * s.w2) * b - s.w2 * bb);
    const Voigt vb = to_voigt<3>(b), vbb = to_voigt<3>(bb);
    Eigen::Matrix<double, 6, 6> c =
        4 * ((s.w11 + 2 * i1 * s.w12 + s.w2 + i1 * i1 * s.w22) * vb * vb.transpose() -
             (s.w12 + i1 * s.w22) * (vb * vbb.transpose() + vbb * vb.transpose()) +
             s.w22 * vbb * vbb.transpose() - s.w2 * symmetric_product(b, b));

    Eigen::Matrix<double, 6, 6> deviator = symmetric_product(one, one);
    deviator.topLeftCorner<3, 3>().array() -= 1.0 / 3;
    const Mat<3> tau = fictitious - fictitious.trace() / 3 * one;
    const Voigt v_tau = to_voigt<3>(tau), v_one = to_voigt<3>(one);
    // Strains enter with engineering shear, so the projection on the right needs its transpose on
    // stresses: entries of `deviator` between shears are 1/2, those of the identity on stresses 1.
    Eigen::Matrix<double, 6, 6> project = deviator;
    project.bottomRightCorner<3, 3>() *= 2;
    c = (project * c * project.transpose()).eval();
    c += 2.0 / 3 *
         (fictitious.trace() * deviator - v_tau * v_one.transpose() - v_one * v_tau.transpose());
    return {F.inverse().transpose(), tau, tau, c};
  }
};

/// W_iso = sum_p mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3), l the principal stretches
/// of F J^-1/3.
struct Ogden {
  std::vector<double> mu;    ///< [Pa]
  std::vector<double> alpha; ///< [1]
  Volume volume;

  double shear_modulus() const { ///< of small strains [Pa]
    double sum = 0;
    for (std::size_t p = 0; p < mu.size(); ++p)
      sum += 0.5 * mu[p] * alpha[p];
    return sum;
  }

  /// Strain energy per reference volume [J/m^3] from the squares of the principal stretches of F.
  template <class Number> Number energy_of(const std::array<Number, 3> &squares) const {
    using std::pow, std::sqrt;
    const Number product = squares[0] * squares[1] * squares[2];
    Number sum = volume.energy(Number(sqrt(product)));
    for (std::size_t p = 0; p < mu.size(); ++p) {
      const Number scale = pow(product, -alpha[p] / 6);
      for (const Number &square : squares)
        sum += mu[p] / alpha[p] * (scale * pow(square, 0.5 * alpha[p]) - 1.0);
    }
    return sum;
  }
  double energy(const Mat<3> &F) const {
    const Vec<3> squares =
        Eigen::SelfAdjointEigenSolver<Mat<3>>(F * F.transpose(), Eigen::EigenvaluesOnly)
            .eigenvalues();
    return energy_of<double>({squares[0], squares[1], squares[2]});
  }

  /// Response of the distortion alone. Source of the principal form: Bonet and Wood (2008), (6.90).
  VoigtResponse<3> distortion(const Mat<3> &F) const;

private:
  struct Principal {
    Vec<3> stress = Vec<3>::Zero();    // tau_A [Pa]
    Mat<3> stiffness = Mat<3>::Zero(); // d tau_A / d ln l_B [Pa]
  };
  Principal principal(const Vec<3> &stretches) const;
};

inline Ogden::Principal Ogden::principal(const Vec<3> &stretches) const {
  Principal r;
  for (std::size_t p = 0; p < mu.size(); ++p) {
    const Vec<3> power = stretches.array().pow(alpha[p]);
    const double mean = power.mean();
    r.stress += mu[p] * (power.array() - mean).matrix();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        r.stiffness(a, b) +=
            mu[p] * alpha[p] * ((a == b ? power[a] : 0.0) - (power[a] + power[b] - mean) / 3);
  }
  return r;
}

inline VoigtResponse<3> Ogden::distortion(const Mat<3> &F) const {
  const Eigen::SelfAdjointEigenSolver<Mat<3>> b(F * F.transpose());
  const Vec<3> squares = b.eigenvalues();
  const Mat<3> &n = b.eigenvectors();
  const double volume_ratio = std::sqrt(squares.prod());
  const Principal r = principal(squares.cwiseSqrt() / std::cbrt(volume_ratio));
  const Mat<3> tau = n * r.stress.asDiagonal() * n.transpose();
  Eigen::Matrix<double, 6, 6> c = Eigen::Matrix<double, 6, 6>::Zero();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Matrix<double, 6, 1> nn = to_voigt<3>(n.col(i) * n.col(i).transpose());
      const Eigen::Matrix<double, 6, 1> mm = to_voigt<3>(n.col(k) * n.col(k).transpose());
      c += (r.stiffness(i, k) - (i == k ? 2 * r.stress[i] : 0.0)) * nn * mm.transpose();
      if (i >= k)
        continue;
      // Where two stretches meet the quotient is a limit; 1e-6 leaves both forms 1e-9 exact.
      const double gap = squares[k] - squares[i];
      const double shear = gap > 1e-6 * squares[k]
                               ? (r.stress[k] * squares[i] - r.stress[i] * squares[k]) / gap
                               : 0.5 * (r.stiffness(k, k) - r.stiffness(i, k)) - r.stress[k];
      const Mat<3> mixed = n.col(i) * n.col(k).transpose() + n.col(k) * n.col(i).transpose();
      const Eigen::Matrix<double, 6, 1> ik = to_voigt<3>(mixed);
      c += shear * ik * ik.transpose();
    }
  return {F.inverse().transpose(), tau, tau, c};
}

} // namespace sluice::solid
