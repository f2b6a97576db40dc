// Builds a Pinocchio model, for any scalar, from a description in plain text. KINDS are those joints that it may have.
//
// Words are separated by white space. A number is written out, or is `p3` or `-p3` for parameter 3:
//   gravity X Y Z                         m/s^2, world axes
//   joint PARENT KIND X Y Z               joints are numbered from 1 in their order, 0 is the ground; KIND is RX RY RZ
//                                         PX PY PZ or S; X Y Z its place on the parent, parent axes, m
//   body JOINT M  X Y Z  XX XY XZ YY YZ ZZ   mass, kg; centre of mass, m, and inertia about it, kg m^2, in joint axes

#include <istream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <pinocchio/multibody.hpp>

#ifndef KINDS
#define KINDS RX, RY, RZ, PX, PY, PZ, S
#endif

namespace peers {

// The kinds of joints: their words, and what they are in Pinocchio.
template <int axis>
struct Revolute {
    template <class Scalar, int O> using Model = pinocchio::JointModelRevoluteTpl<Scalar, O, axis>;
    template <class Scalar, int O> using Data = pinocchio::JointDataRevoluteTpl<Scalar, O, axis>;
};
template <int axis>
struct Prismatic {
    template <class Scalar, int O> using Model = pinocchio::JointModelPrismaticTpl<Scalar, O, axis>;
    template <class Scalar, int O> using Data = pinocchio::JointDataPrismaticTpl<Scalar, O, axis>;
};
struct RX : Revolute<0> { static constexpr auto word = "RX"; };
struct RY : Revolute<1> { static constexpr auto word = "RY"; };
struct RZ : Revolute<2> { static constexpr auto word = "RZ"; };
struct PX : Prismatic<0> { static constexpr auto word = "PX"; };
struct PY : Prismatic<1> { static constexpr auto word = "PY"; };
struct PZ : Prismatic<2> { static constexpr auto word = "PZ"; };
struct S {
    static constexpr auto word = "S";
    template <class Scalar, int O> using Model = pinocchio::JointModelSphericalTpl<Scalar, O>;
    template <class Scalar, int O> using Data = pinocchio::JointDataSphericalTpl<Scalar, O>;
};

template <class... Kind>
struct Listed {
    template <class Scalar, int O> using Models = boost::variant<typename Kind::template Model<Scalar, O>...>;
    template <class Scalar, int O> using Data = boost::variant<typename Kind::template Data<Scalar, O>...>;

    template <class Variant, class Scalar>
    static std::map<std::string, Variant> by_word() { return {{Kind::word, typename Kind::template Model<Scalar, 0>()}...}; }
};
using Kinds = Listed<KINDS>;

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

// `Joints` is one of Pinocchio's collections of joints: what the variants of Model are made of.
template <class Scalar, template <class, int> class Joints>
pinocchio::ModelTpl<Scalar, 0, Joints> build(const std::string &text, const std::vector<Scalar> &parameters)
{
    using Place = pinocchio::SE3Tpl<Scalar>;
    const auto kinds = Kinds::by_word<typename Joints<Scalar, 0>::JointModelVariant, Scalar>();
    pinocchio::ModelTpl<Scalar, 0, Joints> model;
    Reader<Scalar> reader(text, parameters);
    std::string what;
    while (reader.next(what)) {
        if (what == "gravity") {
            model.gravity.linear() = reader.vector();
        } else if (what == "joint") {
            const std::size_t parent = reader.index();
            const auto kind = kinds.find(reader.word());
            if (kind == kinds.end()) throw std::runtime_error("unknown kind of joint");
            Place place = Place::Identity();
            place.translation() = reader.vector();
            model.addJoint(parent, kind->second, place, "joint" + std::to_string(model.njoints));
        } else if (what == "body") {
            const std::size_t joint = reader.index();
            const Scalar mass = reader.number();
            const auto com = reader.vector();
            const pinocchio::Symmetric3Tpl<Scalar> inertia(reader.symmetric());
            model.inertias.at(joint) = pinocchio::InertiaTpl<Scalar>(mass, com, inertia);
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
