// plant - reads and computes the forces from outside.
#include "host_sim/machine/plant/link_forces.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::plant {
namespace {

KDL::Vector ReadVector(const io::TomlReader& keys, const std::string& key) {
  const auto xyz = keys.Numbers(key, 3);
  return {xyz[0], xyz[1], xyz[2]};
}

// A hose from the flange to a hook in the cell. It pulls when it is longer than its free length, ever harder, and half
// its weight hangs on the flange.
class Hose : public LinkForce {
 public:
  explicit Hose(const io::TomlReader& keys)
      : anchor_(ReadVector(keys, "anchor_m")),
        rate_Npm_(keys.Positive("rate_Npm")),
        free_m_(keys.NotNegative("free_length_m", 0)),
        stiffening_m_(keys.NotNegative("stiffening_m", 0)),
        mass_kg_(keys.NotNegative("mass_kg", 0)) {}
  KDL::Vector At(const KDL::Vector& place, const KDL::Vector&, double) const override {
    const KDL::Vector away = anchor_ - place;
    const double length = away.Norm(), stretch = std::max(0.0, length - free_m_);
    const double more = stiffening_m_ > 0 ? stretch / stiffening_m_ : 0;
    return away * (rate_Npm_ * stretch * (1 + more * more) / std::max(length, 1e-9)) +
           KDL::Vector(0, 0, -0.5 * mass_kg_ * 9.81);
  }
  std::unique_ptr<LinkForce> Copy() const override { return std::make_unique<Hose>(*this); }

 private:
  KDL::Vector anchor_;
  double rate_Npm_, free_m_, stiffening_m_, mass_kg_;
};

// A pad at a point in space. The flange sinks into it along the normal as into a spring with a damper, and sticks to it
// sideways by a spring that slips at the edge of the friction cone.
class Pad : public LinkForce {
 public:
  explicit Pad(const io::TomlReader& keys)
      : center_(ReadVector(keys, "at_m")),
        normal_(ReadVector(keys, "normal")),
        radius_m_(keys.Positive("radius_m", 1e3)),
        rate_Npm_(keys.Positive("rate_Npm")),
        damping_Nspm_(keys.NotNegative("damping_Nspm", 0)),
        friction_(keys.NotNegative("friction", 0.3)),
        until_s_(keys.Positive("for_s", 1e9)) {
    if (normal_.Norm() < 1e-6) keys.Fail("normal", "a direction out of the pad");
    normal_.Normalize();
  }
  KDL::Vector At(const KDL::Vector& place, const KDL::Vector& speed, double since_s) const override {
    const double depth = Depth(place);
    if (depth <= 0 || since_s > until_s_) return KDL::Vector::Zero();
    const double push = std::max(0.0, rate_Npm_ * depth - damping_Nspm_ * KDL::dot(speed, normal_));
    KDL::Vector side = (stuck_at_ - place) * rate_Npm_;
    side = side - normal_ * KDL::dot(side, normal_);
    const double most = friction_ * push, norm = side.Norm();
    return normal_ * push + (norm > most ? side * (most / norm) : side);
  }
  void Remember(const KDL::Vector& place) override {
    const double depth = Depth(place);
    const KDL::Vector off = stuck_at_ - place, side = off - normal_ * KDL::dot(off, normal_);
    const double most = friction_ * std::max(0.0, depth), norm = side.Norm();
    stuck_at_ = place + (norm > most ? side * (most / norm) : side);
  }
  std::unique_ptr<LinkForce> Copy() const override { return std::make_unique<Pad>(*this); }

 private:
  double Depth(const KDL::Vector& place) const {
    const KDL::Vector off = place - center_;
    const double out = KDL::dot(off, normal_);
    return (off - normal_ * out).Norm() > radius_m_ ? 0 : -out;
  }

  KDL::Vector center_, normal_;
  double radius_m_, rate_Npm_, damping_Nspm_, friction_, until_s_;
  KDL::Vector stuck_at_ = KDL::Vector::Zero();
};

// Somebody leans on a point of a link: the force rises, stays and falls.
class Push : public LinkForce {
 public:
  explicit Push(const io::TomlReader& keys)
      : force_N_(ReadVector(keys, "force_N")), for_s_(keys.Positive("for_s")), rise_s_(keys.Positive("rise_s", 0.1)) {
    point = ReadVector(keys, "point_m");
    if (2 * rise_s_ > for_s_) keys.Fail("rise_s", "at most half of for_s");
  }
  KDL::Vector At(const KDL::Vector&, const KDL::Vector&, double since_s) const override {
    return force_N_ * std::clamp(std::min(since_s, for_s_ - since_s) / rise_s_, 0.0, 1.0);
  }
  std::unique_ptr<LinkForce> Copy() const override { return std::make_unique<Push>(*this); }
  bool at_flange() const override { return false; }

 private:
  KDL::Vector force_N_;
  double for_s_, rise_s_;
};

template <class Force>
std::unique_ptr<LinkForce> ReadForce(const io::TomlReader& keys) {
  return std::make_unique<Force>(keys);
}

}  // namespace

const LinkForceReaders& AllLinkForces() {
  static const LinkForceReaders readers{
      {"flange_hose", ReadForce<Hose>}, {"flange_contact", ReadForce<Pad>}, {"external_contact", ReadForce<Push>}};
  return readers;
}

}  // namespace armcal::plant
