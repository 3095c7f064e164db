// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/urdf.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/model/model_operations.h>
#include <dyntape/dynamics/urdf/check.h>
#include <dyntape/dynamics/urdf/dom.h>
#include <dyntape/dynamics/urdf/rotation_snap.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

constexpr const char* kRootJoint = "root_joint";

void check_options(const UrdfOptions& options) {
  if (!(options.snap >= 0 && options.snap <= 0.01))
    throw ArgumentError("snap is " + digits(options.snap) + " rad; expected an angle of 0 to 0.01");
}

Eigen::Vector3d to_eigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

// The shortest rotation from z to the unit vector n = (x, y, z); if n points down, the one to -n after half
// a turn about x.
Matrix3<double> rotation_to(const Eigen::Vector3d& n) {
  const double up = n[2] < 0 ? -1 : 1, x = up * n[0], y = up * n[1], z = up * n[2], k = 1 / (1 + z);
  const double rows[3][3] = {{1 - x * x * k, -x * y * k, x}, {-x * y * k, 1 - y * y * k, y}, {-x, -y, z}};
  Matrix3<double> R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = j == 0 ? rows[i][j] : up * rows[i][j];
  }
  return R;
}

// Builds the model from urdfdom's tree.  urdfdom gives every rotation as a quaternion, which has lost the
// digits of the right angles, so rotations come from the text.
class TreeReader {
 public:
  TreeReader(const UrdfText& text, const UrdfOptions& options) : text_(text), options_(options) {}

  UrdfRobot read(const urdf::ModelInterface& tree) {
    robot_.model.name = tree.getName();
    const urdf::LinkConstSharedPtr root = tree.getRoot();
    Visit first{root.get(), nullptr, -1, {}};
    if ((options_.base == Base::kFloating && !floats_by_itself(*root)) || !options_.root.empty())
      first.body = add_root_joint(*root);
    // Depth first without recursion: a chain may be as long as memory allows.
    std::vector<Visit> open{first};
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const Visit here = enter(visit);
      const auto& links = here.link->child_links;
      for (size_t k = links.size(); k-- > 0;)
        open.push_back({links[k].get(), here.link->child_joints[k].get(), here.body, here.X_BL});
    }
    return std::move(robot_);
  }

 private:
  // A link about to be entered through `joint` from the link placed by X_BL in `body`; after enter(), the
  // link's own body and placement.
  struct Visit {
    const urdf::Link* link;
    const urdf::Joint* joint;
    int body;
    Placement<double> X_BL;
  };

  Visit enter(const Visit& visit) {
    Visit here = visit;
    if (visit.joint) {
      const XMLElement& element = in_text(text_.find_joint(visit.joint->name), visit.joint->name);
      const Placement<double> fixed_side =
          visit.X_BL * placement(element, element, visit.joint->parent_to_joint_origin_transform.position);
      if (visit.joint->type == urdf::Joint::FIXED) {
        here.X_BL = fixed_side;
        if (here.body >= 0) {
          Inertia<double>& carrier = robot_.model.inertias[here.body];
          carrier = welded(carrier, act(here.X_BL, inertia(*visit.link)));
        }
      } else {
        const Joint<double> moving = joint(*visit.joint, element);
        const Placement<double> turned = body_of_link(moving, element);
        here.X_BL = inverse(turned);
        here.body = robot_.model.add_joint(visit.body, moving, fixed_side * turned,
                                           act(here.X_BL, inertia(*visit.link)));
        if (options_.mimic && visit.joint->mimic) add_mimic(visit.joint->name, *visit.joint->mimic);
      }
    }
    robot_.model.frames.push_back({here.link->name, here.body, here.X_BL});
    return here;
  }

  void add_mimic(const std::string& name, const urdf::JointMimic& mimic) {
    robot_.mimics.push_back({name, mimic.joint_name, mimic.multiplier, mimic.offset});
  }

  // The frame of a body in its link's frame: z along the normal of a planar joint, the link's own for others.
  Placement<double> body_of_link(const Joint<double>& joint, const XMLElement& element) {
    const Eigen::Vector3d& n = joint.axis;
    if (joint.type != JointType::kPlanar || n == Eigen::Vector3d::UnitZ()) return {};
    robot_.notes.push_back(text_.where(element) + describe(element) + " moves in the plane normal to (" +
                           digits(n[0]) + " " + digits(n[1]) + " " + digits(n[2]) +
                           "); the frame of its body is turned so that z is this direction");
    return {rotation_to(n), Eigen::Vector3d::Zero()};
  }

  // The file has the floating base as a joint of its own.
  static bool floats_by_itself(const urdf::Link& root) {
    const auto& joints = root.child_joints;
    return std::any_of(joints.begin(), joints.end(),
                       [](const auto& joint) { return joint->type == urdf::Joint::FLOATING; });
  }

  int add_root_joint(const urdf::Link& root) {
    if (const XMLElement* taken = text_.find_joint(kRootJoint))
      text_.fail(*taken,
                 describe(*taken) + " has the name of the floating base's joint; expected another name");
    Joint<double> joint;
    joint.name = kRootJoint;
    joint.type = JointType::kFreeFlyer;
    return robot_.model.add_joint(-1, joint, {}, inertia(root));
  }

  // The two readers of the file agree on every name but those with odd bytes or entities.
  const XMLElement& in_text(const XMLElement* element, const std::string& name) const {
    if (element) return *element;
    text_.fail(text_.robot(), "urdfdom reads a name as \"" + name +
                                  "\", which the file does not hold; expected " +
                                  "names of plain characters");
  }

  // <origin> below `element`; `owner` is the link or joint to name in notes.
  Placement<double> placement(const XMLElement& owner, const XMLElement& element,
                              const urdf::Vector3& position) {
    const Eigen::Vector3d rpy = text_.vector_below(element, "origin", "rpy", Eigen::Vector3d::Zero());
    const SnappedRotation rotation = rotation_from_rpy(rpy, options_.snap);
    if (const XMLElement* origin = element.FirstChildElement("origin"))
      note_snap(*origin, owner, "a rotation", rotation.moved, rotation.near);
    return {rotation.R, to_eigen(position)};
  }

  Inertia<double> inertia(const urdf::Link& link) {
    if (!link.inertial) return {};
    const urdf::Inertial& i = *link.inertial;
    const XMLElement& element = in_text(text_.find_link(link.name), link.name);
    const Placement<double> X = placement(element, *element.FirstChildElement("inertial"), i.origin.position);
    const Matrix3<double> I(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    return {i.mass, X.p, rotate_symmetric(X.R, I)};
  }

  Joint<double> joint(const urdf::Joint& source, const XMLElement& element) {
    Joint<double> joint;
    joint.name = source.name;
    joint.type = joint_type(source);
    const SnappedAxis axis = axis_from_direction(to_eigen(source.axis), options_.snap);
    joint.axis = axis.axis;
    if (const XMLElement* tag = element.FirstChildElement("axis"))
      note_snap(*tag, element, "an axis", axis.moved, axis.near);
    if (source.limits) {
      joint.limits.velocity = source.limits->velocity;
      joint.limits.effort = source.limits->effort;
      if (source.type != urdf::Joint::CONTINUOUS && source.type != urdf::Joint::PLANAR) {
        joint.limits.lower = source.limits->lower;
        joint.limits.upper = source.limits->upper;
      }
    }
    if (source.dynamics) {
      joint.damping = source.dynamics->damping;
      joint.friction = source.dynamics->friction;
    }
    return joint;
  }

  JointType joint_type(const urdf::Joint& source) const {
    if (source.type == urdf::Joint::FLOATING) return JointType::kFreeFlyer;
    if (source.type == urdf::Joint::PLANAR) return JointType::kPlanar;
    if (source.type == urdf::Joint::PRISMATIC) return JointType::kPrismatic;
    const bool pair =
        source.type == urdf::Joint::CONTINUOUS && options_.continuous == ContinuousJoint::kCosSin;
    return pair ? JointType::kContinuous : JointType::kRevolute;
  }

  void note_snap(const XMLElement& at, const XMLElement& owner, const char* what, double moved, double near) {
    constexpr double kRounding = 1e-15;  // below it the text had all its digits
    const std::string subject = text_.where(at) + describe(owner) + " has ";
    if (moved > kRounding)
      robot_.notes.push_back(subject + what + " snapped to a right angle, by " + digits(moved) + " rad");
    if (near > kRounding)
      robot_.notes.push_back(subject + what + " " + digits(near) + " rad off a right angle, kept as " +
                             "written; a snap tolerance above that makes it exact");
  }

  const UrdfText& text_;
  const UrdfOptions& options_;
  UrdfRobot robot_;
};

// Says where in the text the rule is that cannot be followed.
void check_mimics(const UrdfText& text, const UrdfRobot& robot) {
  if (const auto fault = mimic_fault(joint_kinds(robot.model), robot.mimics))
    text.fail(*text.find_joint(fault->joint)->FirstChildElement("mimic"), fault->sentence);
}

}  // namespace

UrdfRobot read_urdf_text(const std::string& text, const std::string& file, const UrdfOptions& options) {
  check_options(options);
  const UrdfText positions = parse_urdf_text(text, file);
  std::vector<std::string> notes = check_urdf(positions, options.accept_nonphysical_inertia, options.mimic);
  const UrdfDom dom = read_with_urdfdom(text, positions, file);
  UrdfRobot robot = TreeReader(positions, options).read(*dom.model);
  notes.insert(notes.end(), dom.notes.begin(), dom.notes.end());
  robot.notes.insert(robot.notes.begin(), notes.begin(), notes.end());
  check_mimics(positions, robot);
  robot.left_out = elements_left_out(positions);
  if (options.base == Base::kFixed && options.root.empty() && dom.model->getRoot()->inertial)
    robot.left_out.push_back("<inertial> of the link that is the world, \"" + dom.model->getRoot()->name +
                             "\"");
  if (!options.root.empty()) robot.model = change_base(robot.model, options.root, options.base);
  if (!options.lock.empty()) robot.model = lock_with_followers(robot.model, options.lock, robot.mimics);
  return robot;
}

UrdfRobot read_urdf(const std::string& path, const UrdfOptions& options) {
  return read_urdf_text(read_file(path), path, options);
}

Model<double> load_urdf(const std::string& path, const UrdfOptions& options) {
  return read_urdf(path, options).model;
}

Model<double> load_urdf_text(const std::string& text, const std::string& file, const UrdfOptions& options) {
  return read_urdf_text(text, file, options).model;
}

}  // namespace dyntape::dynamics
