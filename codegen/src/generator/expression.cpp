// generator - the parser of expressions. Every error names its column.
#include "codegen/src/generator/expression.hpp"

#include <cctype>
#include <charconv>
#include <cmath>

#include "codegen/src/io/input_error.hpp"

namespace armcal::codegen {
namespace {

Expr Clamp(Graph& g, Expr x, Expr lower, Expr upper) { return g.Binary(Op::kMin, g.Binary(Op::kMax, x, lower), upper); }

// Cubic B-spline of unit knot spacing with support [0, 4], by truncated powers; u is clamped so that none of them
// grows.
Expr CardinalSpline(Graph& g, Expr u) {
  const Expr x = Clamp(g, u, g.Constant(0), g.Constant(4));
  Expr sum = g.Constant(0);
  const double binomial[] = {1, -4, 6, -4};
  for (int k = 0; k < 4; ++k) {
    const Expr p = g.Binary(Op::kMax, x - static_cast<double>(k), g.Constant(0));
    sum = sum + binomial[k] / 6 * (p * p * p);
  }
  return sum;
}

// A name for what a function keeps: the same function of the same arguments is one state.
std::string StateName(const char* function, const std::vector<Expr>& a, int part = 0) {
  std::string name = function + std::string(part ? std::to_string(part) : "") + "(";
  for (const Expr& e : a) name += (name.back() == '(' ? "#" : ", #") + std::to_string(e.id());
  return name + ")";
}

Expr Previous(Graph& g, const std::vector<Expr>& a) {
  return g.State(StateName("previous", a), a[0], [&](Expr) { return a[0]; });
}

Expr Lowpass(Graph& g, const std::vector<Expr>& a) {
  const auto step = [&](Expr y) {
    const Expr rest = g.Unary(Op::kExp, -(g.Input({Quantity::kTimeStep}) / a[1]));
    return a[0] + rest * (y - a[0]);
  };
  return step(g.State(StateName("lowpass", a), a[0], step));
}

// A mass that follows x on a spring and a damper: y'' = w0^2 (x - y) + 2 zeta w0 (x' - y'), x straight between samples
// (held, it would lead by half of dt): the exact solution after dt. The states are y - x, which no rounding of x hides,
// and y'.
Expr Spring(Graph& g, const std::vector<Expr>& a, bool is_rate) {
  const Expr x = a[0], w0 = a[1], zeta = a[2], dt = g.Input({Quantity::kTimeStep});
  const Expr damped = w0 * g.Unary(Op::kSqrt, g.Constant(1) - zeta * zeta), angle = damped * dt;
  const Expr decay = g.Unary(Op::kExp, -(zeta * w0 * dt));
  const Expr c = decay * g.Unary(Op::kCos, angle), s = decay * g.Unary(Op::kSin, angle) / damped;
  const Expr slope = (x - Previous(g, {x})) / dt;
  const auto stretch = [&](Expr ahead, Expr rate) { return ahead * (c + zeta * w0 * s) + (rate - slope) * s; };
  const auto speed = [&](Expr ahead, Expr rate) {
    return slope + (rate - slope) * (c - zeta * w0 * s) - ahead * (w0 * w0) * s;
  };
  const std::string name = StateName("spring", a), rate_name = StateName("spring", a, 1);
  const Expr ahead = g.State(name, g.Constant(0), [&](Expr value) {
    const Expr rate = g.State(rate_name, g.Constant(0), [&](Expr r) { return speed(value, r); });
    return stretch(value, rate);
  });
  const Expr rate = g.State(rate_name, g.Constant(0), [](Expr r) { return r; });
  return is_rate ? speed(ahead, rate) : stretch(ahead, rate);
}

// A mass between two stops that are `gap` apart, against these stops: its place from the middle, and whether it is in
// flight, 1 or 0. a: its acceleration, straight between samples. It stays where it lands, until a pushes it away.
Expr Flight(Graph& g, const std::vector<Expr>& a, bool is_place) {
  const Expr half = 0.5 * a[1], dt = g.Input({Quantity::kTimeStep}), before = Previous(g, {a[0]});
  const auto flown = [&](Expr place, Expr speed) {
    return place + (speed + (2.0 * before + a[0]) * dt / g.Constant(6)) * dt;
  };
  const auto lands = [&](Expr to) { return Clamp(g, to, -half, half); };
  const auto flies = [&](Expr to) { return g.Constant(1) - g.Unary(Op::kAbs, g.Unary(Op::kSign, to - lands(to))); };
  const std::string name = StateName("flight", a), speed_name = StateName("flight", a, 1);
  const Expr place = g.State(name, half * g.Unary(Op::kSign, a[0]), [&](Expr p) {
    const Expr speed = g.State(speed_name, g.Constant(0),
                               [&](Expr v) { return flies(flown(p, v)) * (v + 0.5 * ((before + a[0]) * dt)); });
    return lands(flown(p, speed));
  });
  const Expr to = flown(place, g.State(speed_name, g.Constant(0), [](Expr v) { return v; }));
  return is_place ? lands(to) : flies(to);
}

Expr Play(Graph& g, const std::vector<Expr>& a) {
  const Expr half = 0.5 * a[1];
  const auto step = [&](Expr z) { return Clamp(g, z, a[0] - half, a[0] + half); };
  return step(g.State(StateName("play", a), a[0], step));
}

Expr Delay(Graph& g, const std::vector<Expr>& a, int taps) {
  const Expr u = Clamp(g, a[1] / g.Input({Quantity::kTimeStep}), g.Constant(0), g.Constant(taps));
  Expr tap = a[0], sum = g.Constant(0);
  for (int k = 0; k <= taps; ++k) {
    const Expr weight =
        g.Binary(Op::kMax, g.Constant(0), g.Constant(1) - g.Unary(Op::kAbs, u - static_cast<double>(k)));
    sum = sum + weight * tap;
    const Expr newer = tap;
    if (k < taps) tap = g.State(StateName("delay", a, k + 1), a[0], [&](Expr) { return newer; });
  }
  return sum;
}

class Parser {
 public:
  Parser(Graph& graph, const std::string& text, const Scope& scope, const std::string& where)
      : g_(graph), text_(text), scope_(scope), where_(where) {}

  Expr Whole() {
    const Expr e = Sum();
    if (Peek() != '\0') Fail("an operator or the end");
    return e;
  }

 private:
  [[noreturn]] void Fail(const std::string& expected) {
    throw io::InputError(where_ + ": \"" + text_ + "\", column " + std::to_string(at_ + 1) + ": expected " + expected);
  }
  char Peek() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Accept(char c) { return Peek() == c ? (++at_, true) : false; }
  void Expect(char c) {
    if (!Accept(c)) Fail(std::string("'") + c + "'");
  }

  Expr Sum() {
    Expr e = Product();
    for (;;) {
      if (Accept('+')) e = e + Product();
      else if (Accept('-')) e = e - Product();
      else return e;
    }
  }
  Expr Product() {
    Expr e = Factor();
    for (;;) {
      if (Accept('*')) e = e * Factor();
      else if (Accept('/')) e = e / Factor();
      else return e;
    }
  }
  Expr Factor() {
    if (Accept('-')) return -Factor();
    const Expr base = Primary();
    if (!Accept('^')) return base;
    return g_.Binary(Op::kPow, base, Factor());
  }
  Expr Primary() {
    const char c = Peek();
    if (Accept('(')) {
      const Expr e = Sum();
      Expect(')');
      return e;
    }
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') {
      double value = 0;
      const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
      if (error != std::errc()) Fail("a number");
      at_ = end - text_.data();
      return g_.Constant(value);
    }
    if (!std::isalpha(static_cast<unsigned char>(c)) && c != '_') Fail("a number, a name or '('");
    const std::size_t begin = at_;
    const std::string name = Name();
    if (Accept('(')) return Call(name, begin);
    std::vector<std::string> indices;
    if (Accept('[')) {
      do {
        Peek();
        indices.push_back(Name());
      } while (Accept(','));
      Expect(']');
    }
    Expr value;
    if (!scope_.lookup(name, indices, value)) {
      at_ = begin;
      Fail("a known name instead of '" + name + "'");
    }
    return value;
  }
  std::string Name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) ++at_;
    if (at_ == begin) Fail("a name");
    return text_.substr(begin, at_ - begin);
  }
  double ConstantOf(Expr e, const char* what) {
    const Node& n = g_.nodes()[e.id()];
    if (n.op != Op::kConstant) Fail(what);
    return n.value;
  }
  Expr Call(const std::string& name, std::size_t begin) {
    std::vector<Expr> a;
    if (!Accept(')')) {
      do a.push_back(Sum());
      while (Accept(','));
      Expect(')');
    }
    const auto need = [&](std::size_t count) {
      if (a.size() != count) {
        at_ = begin;
        Fail(std::to_string(count) + " argument(s) to " + name);
      }
    };
    static const std::pair<const char*, Op> unary[] = {{"abs", Op::kAbs},   {"sign", Op::kSign}, {"sin", Op::kSin},
                                                       {"cos", Op::kCos},   {"exp", Op::kExp},   {"log", Op::kLog},
                                                       {"tanh", Op::kTanh}, {"sqrt", Op::kSqrt}, {"cbrt", Op::kCbrt}};
    for (const auto& [word, op] : unary)
      if (name == word) return need(1), g_.Unary(op, a[0]);
    static const std::pair<const char*, Op> binary[] = {{"min", Op::kMin}, {"max", Op::kMax}, {"pow", Op::kPow}};
    for (const auto& [word, op] : binary)
      if (name == word) return need(2), g_.Binary(op, a[0], a[1]);
    if (name == "sgn") return need(1), scope_.sgn(a[0]);
    if (name == "step") return need(1), 0.5 * (g_.Unary(Op::kSign, a[0]) + 1.0);
    if (name == "clamp") return need(3), Clamp(g_, a[0], a[1], a[2]);
    if (name == "sech") {
      need(1);
      const Expr e = g_.Unary(Op::kExp, -g_.Unary(Op::kAbs, a[0]));  // at most 1: no overflow
      return 2.0 * e / (e * e + 1.0);
    }
    if (name == "bspline") {
      need(5);
      const char* const what = "a constant index and count in bspline";
      const double i = ConstantOf(a[3], what), n = ConstantOf(a[4], what);
      const Expr x = Clamp(g_, a[0], a[1], a[2]);
      const Expr u = (n - 3) * ((x - a[1]) / (a[2] - a[1]));  // n splines: n-3 intervals
      return CardinalSpline(g_, u - (i - 3));
    }
    if (name == "previous") return need(1), Previous(g_, a);
    if (name == "lowpass") return need(2), Lowpass(g_, a);
    if (name == "spring_stretch") return need(3), Spring(g_, a, false);
    if (name == "spring_rate") return need(3), Spring(g_, a, true);
    if (name == "play") return need(2), Play(g_, a);
    if (name == "flight_place") return need(2), Flight(g_, a, true);
    if (name == "flies") return need(2), Flight(g_, a, false);
    if (name == "delay") {
      need(3);
      const double taps = ConstantOf(a[2], "a whole number of samples, 1 to 64, in delay");
      if (taps < 1 || taps > 64 || taps != std::floor(taps)) Fail("a whole number of samples, 1 to 64, in delay");
      a.pop_back();
      return Delay(g_, a, static_cast<int>(taps));
    }
    at_ = begin;
    Fail("a known function instead of '" + name + "'");
  }

  Graph& g_;
  const std::string& text_;
  const Scope& scope_;
  const std::string& where_;
  std::size_t at_ = 0;
};

}  // namespace

Expr ParseExpression(Graph& graph, const std::string& text, const Scope& scope, const std::string& where) {
  return Parser(graph, text, scope, where).Whole();
}

}  // namespace armcal::codegen
