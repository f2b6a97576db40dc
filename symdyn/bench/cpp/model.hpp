// Builds a Pinocchio model, for any scalar, from a description in plain text.
//
// Words are separated by white space. A number is written out, or is `p3` or `-p3` for parameter 3:
//   gravity X Y Z                         m/s^2, world axes
//   joint PARENT KIND X Y Z               joints are numbered from 1 in their order, 0 is the ground; KIND is RX RY RZ
//                                         PX PY PZ or S; X Y Z its place on the parent, parent axes, m
//   turned PARENT KIND  X Y Z  R11 R12 R13 R21 ... R33  X Y Z    the same with the axis, which only kinds of the reader's own look
//                                         at, and the axes on the parent
//   frame JOINT  R11 R12 R13 R21 ... R33  X Y Z    the axes of the body that the joint moves, in those of the joint: what is on
//                                         this body is given in them, in the lines that follow
//   body JOINT M  X Y Z  XX XY XZ YY YZ ZZ   mass, kg; centre of mass, m, and inertia about it, kg m^2, in axes of the body

#include <istream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <pinocchio/multibody.hpp>

namespace peers {

template <class Scalar>
class Reader {
public:
    Reader(const std::string &text, const std::vector<Scalar> &parameters) : words_(text), parameters_(parameters) {}

    bool next(std::string &word) { return static_cast<bool>(words_ >> word); }

    std::string word()
    {
        std::string found;
        if (!next(found)) throw std::runtime_error("the description ends in the middle of a line");
        return found;
    }

    std::size_t index() { return std::stoul(word()); }

    Scalar number()
    {
        const std::string found = word();
        const bool negative = found[0] == '-';
        const std::string rest = found.substr(negative ? 1 : 0);
        const Scalar value = rest[0] == 'p' ? parameters_.at(std::stoul(rest.substr(1))) : Scalar(std::stod(rest));
        return negative ? Scalar(-value) : value;
    }

    Eigen::Matrix<Scalar, 3, 1> vector()
    {
        Eigen::Matrix<Scalar, 3, 1> v;
        for (int i = 0; i < 3; i++) v[i] = number();
        return v;
    }

    Eigen::Matrix<Scalar, 3, 3> matrix()
    {
        Eigen::Matrix<Scalar, 3, 3> m;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) m(i, j) = number();
        return m;
    }

    Eigen::Matrix<Scalar, 3, 3> symmetric()
    {
        Eigen::Matrix<Scalar, 3, 3> m;
        for (int i = 0; i < 3; i++)
            for (int j = i; j < 3; j++) m(i, j) = m(j, i) = number();
        return m;
    }

private:
    std::istringstream words_;
    const std::vector<Scalar> &parameters_;
};

// No other kinds of joints than those above.
struct NoOthers {
    template <class Kinds, class Axis>
    void add(Kinds &, const Axis &) const {}
};

// `Joints` is one of Pinocchio's collections of joints: what the variants of Model are made of. `others` adds kinds that turned
// joints may have.
template <class Scalar, template <class, int> class Joints, class Others = NoOthers>
pinocchio::ModelTpl<Scalar, 0, Joints> build(const std::string &text, const std::vector<Scalar> &parameters,
                                             const Others &others = Others())
{
    using Collection = Joints<Scalar, 0>;
    using Place = pinocchio::SE3Tpl<Scalar>;
    std::map<std::string, typename Collection::JointModelVariant> kinds = {
        {"RX", typename Collection::JointModelRX()}, {"RY", typename Collection::JointModelRY()},
        {"RZ", typename Collection::JointModelRZ()}, {"PX", typename Collection::JointModelPX()},
        {"PY", typename Collection::JointModelPY()}, {"PZ", typename Collection::JointModelPZ()},
        {"S", typename Collection::JointModelSpherical()}};
    pinocchio::ModelTpl<Scalar, 0, Joints> model;
    std::map<std::size_t, Place> frames;
    Reader<Scalar> reader(text, parameters);
    std::string what;
    while (reader.next(what)) {
        if (what == "gravity") {
            model.gravity.linear() = reader.vector();
        } else if (what == "joint" || what == "turned") {
            const std::size_t parent = reader.index();
            const std::string name = reader.word();
            Place place = Place::Identity();
            if (what == "turned") {
                others.add(kinds, reader.vector());
                place.rotation() = reader.matrix();
            }
            const auto kind = kinds.find(name);
            if (kind == kinds.end()) throw std::runtime_error("unknown kind of joint '" + name + "'");
            place.translation() = reader.vector();
            if (frames.count(parent)) place = frames.at(parent) * place;
            model.addJoint(parent, kind->second, place, "joint" + std::to_string(model.njoints));
        } else if (what == "body") {
            const std::size_t joint = reader.index();
            const Scalar mass = reader.number();
            const auto com = reader.vector();
            const pinocchio::Symmetric3Tpl<Scalar> inertia(reader.symmetric());
            const pinocchio::InertiaTpl<Scalar> own(mass, com, inertia);
            model.inertias.at(joint) = frames.count(joint) ? frames.at(joint).act(own) : own;
        } else if (what == "frame") {
            const std::size_t joint = reader.index();
            Place place = Place::Identity();
            place.rotation() = reader.matrix();
            place.translation() = reader.vector();
            frames[joint] = place;
        } else {
            throw std::runtime_error("unknown line '" + what + "'");
        }
    }
    return model;
}

// Keeps the message of an exception for the caller; returns whether `work` ended well.
template <class Work>
bool guarded(char *error, long size, Work work)
{
    try {
        work();
        return true;
    } catch (const std::exception &problem) {
        std::string(problem.what()).copy(error, size - 1);
        return false;
    }
}

} // namespace peers
