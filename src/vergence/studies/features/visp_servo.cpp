// Servos from many starts with ViSP, each feature of `vergence reproduce features`, on one thread.
//
// Reads from standard input, as words between spaces:
//   gain period steps                      of a run: 1/s, s, periods at most
//   focal cx cy width height arrived       of the camera, px; all points this near to their goals
//   M, then x y of M corners               of a polygon in the target's plane z = 0, m
//   x y radius                             of a circle in the same plane
//   n, then n + 1 fixed poses              of a chain of joints, each about or along z: [R t], three rows
//   n times 1 (slides) or 0 (turns), n lower, n upper, n rate limits
//   count, then of each run: kind plant T_start T_goal q
//       kind: points, lines, ellipse, moments or 2.5d
//       plant: free (a camera without an arm), arm, or avoidance (an arm with ViSP's secondary task)
//       T_start, T_goal: of the target in the camera, three rows of four; q: n joint positions
//
// Writes ViSP's version, then of each run a line: ending, time (s), path of the camera (m).
//   ending: arrived, view (a point left the image, or its plane turned away), joint (a limit was passed), short, error
#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <visp3/core/vpCircle.h>
#include <visp3/core/vpConfig.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/core/vpLine.h>
#include <visp3/core/vpMomentCommon.h>
#include <visp3/core/vpMomentDatabase.h>
#include <visp3/core/vpMomentObject.h>
#include <visp3/core/vpPlane.h>
#include <visp3/core/vpPoint.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/visual_features/vpFeatureDepth.h>
#include <visp3/visual_features/vpFeatureMomentCommon.h>
#include <visp3/visual_features/vpFeatureThetaU.h>
#include <visp3/vs/vpServo.h>

namespace {

struct Setup {
  double gain, period;
  int steps;
  double focal, cx, cy, width, height, arrived_px;
  std::vector<double> x, y; // of the polygon
  double circle_x, circle_y, radius;
  std::vector<vpHomogeneousMatrix> fixed;
  std::vector<bool> slides;
  vpColVector q_min, q_max, rate_max;
};

template <class T> T next() {
  T value;
  if (!(std::cin >> value))
    throw std::runtime_error("the input ends too early");
  return value;
}

double number() { return next<double>(); }

vpColVector vector_of(int n) {
  vpColVector read(n);
  for (int i = 0; i < n; ++i)
    read[i] = number();
  return read;
}

vpHomogeneousMatrix read_rows() { // [R t], three rows
  vpHomogeneousMatrix T;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j)
      T[i][j] = number();
  return T;
}

Setup read_setup() {
  Setup s;
  s.gain = number();
  s.period = number();
  s.steps = next<int>();
  for (double *value : {&s.focal, &s.cx, &s.cy, &s.width, &s.height, &s.arrived_px})
    *value = number();
  const int corners = next<int>();
  for (int i = 0; i < corners; ++i) {
    s.x.push_back(number());
    s.y.push_back(number());
  }
  s.circle_x = number();
  s.circle_y = number();
  s.radius = number();
  const int n = next<int>();
  for (int i = 0; i <= n; ++i)
    s.fixed.push_back(read_rows());
  for (int i = 0; i < n; ++i)
    s.slides.push_back(next<int>() != 0);
  s.q_min = vector_of(n);
  s.q_max = vector_of(n);
  s.rate_max = vector_of(n);
  return s;
}

vpColVector place_of(const vpHomogeneousMatrix &cMo, double x, double y) {
  vpColVector p(4);
  p[0] = x, p[1] = y, p[2] = 0.0, p[3] = 1.0;
  return cMo * p;
}

// One kind of feature: what it is at a pose, and where its points are in the image.
class Kind {
public:
  explicit Kind(const Setup &setup) : setup_(setup) {}
  virtual ~Kind() = default;
  virtual void begin(vpServo &task, const vpHomogeneousMatrix &start, const vpHomogeneousMatrix &goal) = 0;
  virtual void see(const vpHomogeneousMatrix &cMo) = 0;

  // Normalized coordinates of the points that have to be in view and to arrive; empty if one is behind.
  virtual std::vector<double> points(const vpHomogeneousMatrix &cMo) const {
    std::vector<double> seen;
    for (size_t i = 0; i < setup_.x.size(); ++i) {
      const vpColVector p = place_of(cMo, setup_.x[i], setup_.y[i]);
      if (p[2] <= 0.0)
        return {};
      seen.push_back(p[0] / p[2]);
      seen.push_back(p[1] / p[2]);
    }
    return seen;
  }

protected:
  const Setup &setup_;
};

// One feature for each corner or side.
template <class Feature> class Several : public Kind {
public:
  using Kind::Kind;
  void begin(vpServo &task, const vpHomogeneousMatrix &start, const vpHomogeneousMatrix &goal) override {
    now_.resize(setup_.x.size());
    goal_.resize(now_.size());
    set(goal_, goal);
    set(now_, start);
    for (size_t i = 0; i < now_.size(); ++i)
      task.addFeature(now_[i], goal_[i]);
  }
  void see(const vpHomogeneousMatrix &cMo) override { set(now_, cMo); }

private:
  virtual void build(Feature &feature, size_t i, const vpHomogeneousMatrix &cMo) const = 0;
  void set(std::vector<Feature> &features, const vpHomogeneousMatrix &cMo) const {
    for (size_t i = 0; i < features.size(); ++i)
      build(features[i], i, cMo);
  }
  std::vector<Feature> now_, goal_;
};

class Points : public Several<vpFeaturePoint> {
public:
  using Several::Several;

private:
  void build(vpFeaturePoint &feature, size_t i, const vpHomogeneousMatrix &cMo) const override {
    const vpColVector p = place_of(cMo, setup_.x[i], setup_.y[i]);
    feature.buildFrom(p[0] / p[2], p[1] / p[2], p[2]);
  }
};

class Lines : public Several<vpFeatureLine> {
public:
  using Several::Several;

private:
  // The side from corner i to the next: z = 0, and a plane across.
  void build(vpFeatureLine &feature, size_t i, const vpHomogeneousMatrix &cMo) const override {
    const size_t next = (i + 1) % setup_.x.size();
    const double x = setup_.x[i], y = setup_.y[i];
    const double a = setup_.y[next] - y, b = x - setup_.x[next];
    const double length = std::hypot(a, b);
    vpLine line;
    line.setWorldCoordinates(0, 0, 1, 0, a / length, b / length, 0, -(a * x + b * y) / length);
    line.track(cMo);
    vpFeatureBuilder::create(feature, line);
  }
};

class Ellipse : public Kind {
public:
  using Kind::Kind;
  void begin(vpServo &task, const vpHomogeneousMatrix &start, const vpHomogeneousMatrix &goal) override {
    set(goal_, goal);
    set(now_, start);
    task.addFeature(now_, goal_);
  }
  void see(const vpHomogeneousMatrix &cMo) override { set(now_, cMo); }

  // The ellipse is centre + root u(φ), with root² = 4 n and n its second moments.
  std::vector<double> points(const vpHomogeneousMatrix &cMo) const override {
    const int count = 16;
    for (int i = 0; i < count; ++i) { // the circle itself has to be in front
      const double angle = 2 * M_PI * i / count;
      const double x = setup_.circle_x + setup_.radius * std::cos(angle);
      if (place_of(cMo, x, setup_.circle_y + setup_.radius * std::sin(angle))[2] <= 0.0)
        return {};
    }
    vpFeatureEllipse at;
    set(at, cMo);
    const double a = 4 * at.get_s()[2], b = 4 * at.get_s()[3], c = 4 * at.get_s()[4];
    const double root = std::sqrt(a * c - b * b), scale = 1 / std::sqrt(a + c + 2 * root);
    std::vector<double> seen;
    for (int i = 0; i < count; ++i) {
      const double u = std::cos(2 * M_PI * i / count), v = std::sin(2 * M_PI * i / count);
      seen.push_back(at.get_x() + scale * ((a + root) * u + b * v));
      seen.push_back(at.get_y() + scale * (b * u + (c + root) * v));
    }
    return seen;
  }

private:
  void set(vpFeatureEllipse &feature, const vpHomogeneousMatrix &cMo) const {
    vpCircle circle;
    circle.setWorldCoordinates(0, 0, 1, setup_.circle_x, setup_.circle_y, 0, setup_.radius);
    circle.track(cMo);
    vpFeatureBuilder::create(feature, circle);
  }
  vpFeatureEllipse now_, goal_;
};

// The inside of the polygon, and the moments of it that belong to a pose.
struct Region {
  Region(const Setup &setup, const vpHomogeneousMatrix &cMo) : object(6) {
    std::vector<vpPoint> corners;
    const size_t count = setup.x.size();
    for (size_t i = 0; i <= count; ++i) { // backwards, as ViSP wants the area positive; closed
      const size_t j = (count - i) % count;
      vpPoint corner(setup.x[j], setup.y[j], 0.0);
      corner.track(cMo);
      corners.push_back(corner);
    }
    object.setType(vpMomentObject::DENSE_POLYGON);
    object.fromVector(corners);
    vpPlane plane(0, 0, 1, 0);
    plane.changeFrame(cMo);
    A = -plane.getA() / plane.getD(), B = -plane.getB() / plane.getD(), C = -plane.getC() / plane.getD();
  }
  vpMomentObject object;
  double A, B, C; // 1/Z = A x + B y + C
};

class Moments : public Kind {
public:
  using Kind::Kind;
  void begin(vpServo &task, const vpHomogeneousMatrix &start, const vpHomogeneousMatrix &goal) override {
    Region at_goal(setup_, goal);
    auto database = [&] {
      return std::make_unique<vpMomentCommon>(
          vpMomentCommon::getSurface(at_goal.object), vpMomentCommon::getMu3(at_goal.object),
          vpMomentCommon::getAlpha(at_goal.object), 1 / at_goal.C);
    };
    now_ = database(), goal_ = database();
    now_features_ = std::make_unique<vpFeatureMomentCommon>(*now_);
    goal_features_ = std::make_unique<vpFeatureMomentCommon>(*goal_);
    goal_->updateAll(at_goal.object);
    goal_features_->updateAll(at_goal.A, at_goal.B, at_goal.C);
    see(start);
    auto &now = *now_features_, &desired = *goal_features_;
    task.addFeature(now.getFeatureGravityNormalized(), desired.getFeatureGravityNormalized());
    task.addFeature(now.getFeatureAn(), desired.getFeatureAn());
    task.addFeature(now.getFeatureCInvariant(), desired.getFeatureCInvariant(),
                    vpFeatureMomentCInvariant::selectSx() | vpFeatureMomentCInvariant::selectSy());
    task.addFeature(now.getFeatureAlpha(), desired.getFeatureAlpha());
  }
  void see(const vpHomogeneousMatrix &cMo) override {
    Region region(setup_, cMo);
    now_->updateAll(region.object);
    now_features_->updateAll(region.A, region.B, region.C);
  }

private:
  std::unique_ptr<vpMomentCommon> now_, goal_;
  std::unique_ptr<vpFeatureMomentCommon> now_features_, goal_features_;
};

class TwoAndHalfD : public Kind { // [Malis1999]: the middle of the corners, its depth, the rotation
public:
  using Kind::Kind;
  void begin(vpServo &task, const vpHomogeneousMatrix &start, const vpHomogeneousMatrix &goal) override {
    goal_ = goal;
    const vpColVector p = middle(goal);
    depth_ = p[2];
    goal_point_.buildFrom(p[0] / p[2], p[1] / p[2], p[2]);
    goal_depth_.buildFrom(p[0] / p[2], p[1] / p[2], p[2], 0);
    see(start);
    task.addFeature(point_, goal_point_);
    task.addFeature(log_depth_, goal_depth_);
    task.addFeature(rotation_);
  }
  void see(const vpHomogeneousMatrix &cMo) override {
    const vpColVector p = middle(cMo);
    point_.buildFrom(p[0] / p[2], p[1] / p[2], p[2]);
    log_depth_.buildFrom(p[0] / p[2], p[1] / p[2], p[2], std::log(p[2] / depth_));
    rotation_.buildFrom(goal_ * cMo.inverse());
  }

private:
  vpColVector middle(const vpHomogeneousMatrix &cMo) const {
    double x = 0, y = 0;
    for (size_t i = 0; i < setup_.x.size(); ++i)
      x += setup_.x[i] / setup_.x.size(), y += setup_.y[i] / setup_.x.size();
    return place_of(cMo, x, y);
  }
  vpHomogeneousMatrix goal_;
  double depth_ = 1;
  vpFeaturePoint point_, goal_point_;
  vpFeatureDepth log_depth_, goal_depth_;
  vpFeatureThetaU rotation_{vpFeatureThetaU::cdRc};
};

std::unique_ptr<Kind> kind_of(const std::string &name, const Setup &setup) {
  if (name == "points")
    return std::make_unique<Points>(setup);
  if (name == "lines")
    return std::make_unique<Lines>(setup);
  if (name == "ellipse")
    return std::make_unique<Ellipse>(setup);
  if (name == "moments")
    return std::make_unique<Moments>(setup);
  if (name == "2.5d")
    return std::make_unique<TwoAndHalfD>(setup);
  throw std::runtime_error("no such kind: " + name);
}

// Forward kinematics, and the Jacobian of the tip in its own frame.
vpHomogeneousMatrix walk(const Setup &setup, const vpColVector &q, vpMatrix &J) {
  const size_t n = setup.slides.size();
  std::vector<vpHomogeneousMatrix> axes;
  vpHomogeneousMatrix T;
  for (size_t i = 0; i < n; ++i) {
    T = T * setup.fixed[i];
    axes.push_back(T);
    T = T * (setup.slides[i] ? vpHomogeneousMatrix(0, 0, q[i], 0, 0, 0)
                             : vpHomogeneousMatrix(0, 0, 0, 0, 0, q[i]));
  }
  T = T * setup.fixed[n];
  J.resize(6, n);
  for (size_t i = 0; i < n; ++i) {
    const vpHomogeneousMatrix tip_axis = T.inverse() * axes[i];
    const vpColVector z = tip_axis.getCol(2), o = tip_axis.getCol(3);
    vpColVector axis(3), anchor(3);
    for (int k = 0; k < 3; ++k)
      axis[k] = z[k], anchor[k] = o[k];
    const vpColVector linear = setup.slides[i] ? axis : vpColVector::cross(anchor, axis);
    for (int k = 0; k < 3; ++k)
      J[k][i] = linear[k], J[3 + k][i] = setup.slides[i] ? 0.0 : axis[k];
  }
  return T;
}

bool in_view(const Setup &setup, const std::vector<double> &points) {
  for (size_t i = 0; i < points.size(); i += 2) {
    const double u = setup.cx + setup.focal * points[i], v = setup.cy + setup.focal * points[i + 1];
    if (!(u >= -0.5 && u <= setup.width - 0.5 && v >= -0.5 && v <= setup.height - 0.5))
      return false;
  }
  return !points.empty();
}

bool from_behind(const vpHomogeneousMatrix &cMo) { // ViSP's moments would end the program
  return cMo[0][2] * cMo[0][3] + cMo[1][2] * cMo[1][3] + cMo[2][2] * cMo[2][3] >= 0;
}

double distance_px(const Setup &setup, const std::vector<double> &a, const std::vector<double> &b) {
  double worst = 0;
  for (size_t i = 0; i < a.size(); i += 2)
    worst = std::max(worst, setup.focal * std::hypot(a[i] - b[i], a[i + 1] - b[i + 1]));
  return worst;
}

bool passed(const Setup &setup, const vpColVector &q) {
  for (unsigned i = 0; i < q.size(); ++i)
    if (q[i] < setup.q_min[i] || q[i] > setup.q_max[i])
      return true;
  return false;
}

void slow_to_limits(const Setup &setup, vpColVector &rates) { // all alike, as ViSP's robots do
  double most = 1;
  for (unsigned i = 0; i < rates.size(); ++i)
    most = std::max(most, std::abs(rates[i]) / setup.rate_max[i]);
  rates = rates / most;
}

void run(const Setup &setup) {
  const auto name = next<std::string>(), plant = next<std::string>();
  const vpHomogeneousMatrix start = read_rows(), goal = read_rows();
  vpColVector q = vector_of(setup.slides.size()), rates(setup.slides.size());
  const bool has_arm = plant != "free";
  vpMatrix J;
  vpHomogeneousMatrix cMo = start;
  const vpHomogeneousMatrix target = walk(setup, q, J) * start;

  const auto kind = kind_of(name, setup);
  vpServo task;
  task.setServo(has_arm ? vpServo::EYEINHAND_L_cVe_eJe : vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::MEAN, vpServo::PSEUDO_INVERSE);
  task.setLambda(setup.gain);
  kind->begin(task, start, goal);
  const std::vector<double> desired = kind->points(goal);
  if (has_arm)
    task.set_cVe(vpVelocityTwistMatrix());

  std::string ending = "short";
  double path = 0;
  int k = 0;
  for (;; ++k) {
    const std::vector<double> points = kind->points(cMo);
    if (from_behind(cMo) || !in_view(setup, points)) {
      ending = "view";
      break;
    }
    if (has_arm && passed(setup, q)) {
      ending = "joint";
      break;
    }
    if (distance_px(setup, points, desired) < setup.arrived_px) {
      ending = "arrived";
      break;
    }
    if (k == setup.steps)
      break;
    kind->see(cMo);
    const vpHomogeneousMatrix before = cMo.inverse();
    if (has_arm) {
      task.set_eJe(J);
      const vpColVector last = rates;
      rates = task.computeControlLaw();
      if (plant == "avoidance")
        rates += task.secondaryTaskJointLimitAvoidance(q, last, setup.q_min, setup.q_max);
      slow_to_limits(setup, rates);
      q += rates * setup.period;
      cMo = walk(setup, q, J).inverse() * target;
    } else {
      cMo = vpExponentialMap::direct(task.computeControlLaw(), setup.period).inverse() * cMo;
    }
    path += (cMo.inverse().getTranslationVector() - before.getTranslationVector()).frobeniusNorm();
  }
  std::cout << ending << " " << k * setup.period << " " << path << "\n";
}

} // namespace

int main() {
  try {
    const Setup setup = read_setup();
    std::cout.precision(9);
    std::cout << "ViSP " << VISP_VERSION_MAJOR << "." << VISP_VERSION_MINOR << "." << VISP_VERSION_PATCH << "\n";
    for (int left = next<int>(); left > 0; --left)
      run(setup);
  } catch (const std::exception &error) { // ViSP's are of this kind too
    std::cerr << "visp_servo: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
