// Times ViSP's control ticks and its homography, on one thread.
//
//   visp_tick          prints one JSON object: microseconds per call (median and quartiles) of each case
//   visp_tick serve    answers each line `CASE CALLS` with the seconds per call of that many calls
//
// Cases:
//   tick               four points, current interaction matrix, camera velocity
//   tick_kinematics    the same with the Jacobian of the Afma6 arm, joint velocities
//   tick_joint_limits  the same with ViSP's joint-limit avoidance as secondary task
//   homography_dlt     direct linear transform of four points and its decomposition
//   homography_hlm     Malis's estimate of eight points and its decomposition
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <visp3/robot/vpAfma6.h>
#include <visp3/vision/vpHomography.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

namespace {

// Keeps the compiler from dropping a result that nothing reads.
volatile double sink = 0.0;

// The camera stands off the goal by this much; small changes of it make every tick a new one.
vpHomogeneousMatrix camera_target(double wobble) {
  return vpHomogeneousMatrix(0.05 + wobble, -0.03, 0.6, 0.1, -0.15 + wobble, 0.2);
}

const double kSquare[4][2] = {{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}};

void see(const vpHomogeneousMatrix &cMo, int corner, vpFeaturePoint &point) {
  const double x = kSquare[corner][0], y = kSquare[corner][1];
  const double X = cMo[0][0] * x + cMo[0][1] * y + cMo[0][3];
  const double Y = cMo[1][0] * x + cMo[1][1] * y + cMo[1][3];
  const double Z = cMo[2][0] * x + cMo[2][1] * y + cMo[2][3];
  point.buildFrom(X / Z, Y / Z, Z);
}

// Four points and the images of them that the ticks go through, so that no tick repeats the last.
class Servo {
public:
  static constexpr int kImages = 16;

  explicit Servo(bool with_arm) : with_arm_(with_arm) {
    task_.setServo(with_arm ? vpServo::EYEINHAND_L_cVe_eJe : vpServo::EYEINHAND_CAMERA);
    task_.setInteractionMatrixType(vpServo::CURRENT, vpServo::PSEUDO_INVERSE);
    task_.setLambda(0.5);
    const vpHomogeneousMatrix goal(0, 0, 0.5, 0, 0, 0);
    for (int i = 0; i < 4; ++i) {
      see(goal, i, wanted_[i]);
      task_.addFeature(seen_[i], wanted_[i]);
    }
    for (int k = 0; k < kImages; ++k)
      for (int i = 0; i < 4; ++i)
        see(camera_target(0.002 * k), i, images_[k][i]);
    if (with_arm) {
      arm_.init();
      vpVelocityTwistMatrix cVe;
      arm_.get_cVe(cVe);
      task_.set_cVe(cVe);
      low_ = arm_.getJointMin();
      high_ = arm_.getJointMax();
      q_ = 0.5 * (low_ + high_);
      q_[4] += 0.6;
      // Joint 2 stands inside the band where the avoidance acts.
      q_[1] = high_[1] - 0.05 * (high_[1] - low_[1]);
    }
  }

  vpColVector tick() {
    const auto &image = images_[++turn_ % kImages];
    for (int i = 0; i < 4; ++i)
      seen_[i].buildFrom(image[i].get_x(), image[i].get_y(), image[i].get_Z());
    if (with_arm_) {
      q_[0] += 1e-9;
      arm_.get_eJe(q_, eJe_);
      task_.set_eJe(eJe_);
    }
    return task_.computeControlLaw();
  }

  vpColVector tick_with_joint_limits() {
    vpColVector rates = tick();
    rates += task_.secondaryTaskJointLimitAvoidance(q_, rates, low_, high_);
    return rates;
  }

private:
  bool with_arm_;
  int turn_ = 0;
  vpServo task_;
  vpAfma6 arm_;
  vpMatrix eJe_;
  vpColVector q_, low_, high_;
  vpFeaturePoint seen_[4], wanted_[4], images_[kImages][4];
};

struct PointPairs {
  std::vector<double> xa, ya, xb, yb;

  explicit PointPairs(int count) {
    const vpHomogeneousMatrix a(0, 0, 0.5, 0, 0, 0), b = camera_target(0.0);
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * M_PI * i / count + 0.3;
      const double radius = 0.1 + 0.02 * (i % 3);
      vpColVector point(4);
      point[0] = radius * std::cos(angle);
      point[1] = radius * std::sin(angle);
      point[3] = 1;
      const vpColVector in_a = a * point, in_b = b * point;
      xa.push_back(in_a[0] / in_a[2]);
      ya.push_back(in_a[1] / in_a[2]);
      xb.push_back(in_b[0] / in_b[2]);
      yb.push_back(in_b[1] / in_b[2]);
    }
  }
};

double decompose(const vpHomography &H) {
  vpRotationMatrix R;
  vpTranslationVector t;
  vpColVector n;
  H.computeDisplacement(H, R, t, n);
  return R[0][0] + t[0] + n[0];
}

double homography_dlt(const PointPairs &pairs) {
  vpHomography H;
  vpHomography::DLT(pairs.xb, pairs.yb, pairs.xa, pairs.ya, H, true);
  return decompose(H);
}

double homography_hlm(const PointPairs &pairs) {
  vpHomography H;
  vpHomography::HLM(pairs.xb, pairs.yb, pairs.xa, pairs.ya, true, H);
  return decompose(H);
}

std::string version() {
  std::ostringstream text;
  text << "ViSP " << VISP_VERSION_MAJOR << "." << VISP_VERSION_MINOR << "." << VISP_VERSION_PATCH;
  return text.str();
}

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

double seconds_per_call(const std::function<double()> &call, long calls) {
  const double start = cpu_seconds();
  for (long i = 0; i < calls; ++i)
    sink = sink + call();
  return (cpu_seconds() - start) / static_cast<double>(calls);
}

void print_all(const std::map<std::string, std::function<double()>> &cases) {
  std::cout << "{\"peer\": \"" << version() << "\", \"unit\": \"us\", \"cases\": {";
  const char *separator = "";
  for (const auto &[name, call] : cases) {
    seconds_per_call(call, 2000);
    std::vector<double> rounds;
    for (int i = 0; i < 31; ++i)
      rounds.push_back(1e6 * seconds_per_call(call, 1000));
    std::sort(rounds.begin(), rounds.end());
    std::cout << separator << "\"" << name << "\": {\"median\": " << rounds[15]
              << ", \"low\": " << rounds[7] << ", \"high\": " << rounds[23] << "}";
    separator = ", ";
  }
  std::cout << "}}" << std::endl;
}

void serve(const std::map<std::string, std::function<double()>> &cases) {
  std::cout.precision(12);
  std::cout << version() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string name;
    long calls = 0;
    words >> name >> calls;
    const auto found = cases.find(name);
    if (found == cases.end() || calls < 1)
      std::cout << "error: no case " << line << std::endl;
    else
      std::cout << seconds_per_call(found->second, calls) << std::endl;
  }
}

} // namespace

int main(int argc, char **argv) {
  Servo camera(false), arm(true), limited(true);
  const PointPairs four(4), eight(8);
  const std::map<std::string, std::function<double()>> cases = {
      {"tick", [&] { return camera.tick()[0]; }},
      {"tick_kinematics", [&] { return arm.tick()[0]; }},
      {"tick_joint_limits", [&] { return limited.tick_with_joint_limits()[0]; }},
      {"homography_dlt", [&] { return homography_dlt(four); }},
      {"homography_hlm", [&] { return homography_hlm(eight); }},
  };
  if (argc > 1 && std::string(argv[1]) == "serve")
    serve(cases);
  else
    print_all(cases);
}
