// softarm eval: the model's terms for given states, to compare with other programs.
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

#include "apps/softarm/commands.hpp"
#include "apps/softarm/eval_case.hpp"
#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

void write_vector(JsonWriter& json, const Eigen::Ref<const Eigen::VectorXd>& v) {
  json.open_array();
  for (Eigen::Index i = 0; i < v.size(); ++i) json.value(v(i));
  json.close_array();
}

void write_matrix(JsonWriter& json, const Eigen::MatrixXd& m) {
  json.open_array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) write_vector(json, m.row(i).transpose());
  json.close_array();
}

void write_term(JsonWriter& json, const EvalTerm& term) {
  bool finite = !term.matrices.empty();
  for (const auto& m : term.matrices) finite = finite && m.allFinite();
  if (!finite) return json.null();
  switch (term.shape) {
    case EvalTerm::Shape::number:
      return json.value(term.matrices.front()(0, 0));
    case EvalTerm::Shape::vector:
      return write_vector(json, term.matrices.front().col(0));
    case EvalTerm::Shape::matrix:
      return write_matrix(json, term.matrices.front());
    case EvalTerm::Shape::list:
      json.open_array();
      for (const auto& m : term.matrices) write_matrix(json, m);
      json.close_array();
  }
}

std::string evaluate_file(const std::string& file, MassModel mass, EvalMethod method) {
  JsonWriter json;
  json.open_object();
  json.key("cases");
  json.open_array();
  for (EvalCase& one : read_eval_cases(file)) {
    one.arm.mass = mass;
    json.open_object();
    json.member("id", one.id);
    for (const NamedTerm& term : evaluate(one, method)) {
      json.key(term.name);
      write_term(json, term.term);
    }
    json.close_object();
  }
  json.close_array();
  json.close_object();
  return json.text() + "\n";
}

}  // namespace

void add_eval_command(CLI::App& app) {
  struct Options {
    std::string file;
    std::string mass = "point";
    std::string method = "direct";
  };
  auto options = std::make_shared<Options>();
  auto* command = app.add_subcommand("eval", "Print every term of the model for given states");
  command->add_option("FILE", options->file, "cases as JSON or YAML, see tests/golden/golden.json")
      ->required();
  command->add_option("--mass", options->mass, "where a segment's mass sits: point, distributed")
      ->check(CLI::IsMember({"point", "distributed"}))
      ->capture_default_str();
  command
      ->add_option("--method", options->method,
                   "the route of evaluation: direct, or augmented (polar, point)")
      ->check(CLI::IsMember({"direct", "augmented"}))
      ->capture_default_str();
  command->callback([options] {
    const MassModel mass = options->mass == "point" ? MassModel::point : MassModel::distributed;
    const EvalMethod method =
        options->method == "direct" ? EvalMethod::direct : EvalMethod::augmented;
    try {
      const std::string text = evaluate_file(options->file, mass, method);
      std::fwrite(text.data(), 1, text.size(), stdout);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--method", error.what());
    }
  });
}

}  // namespace softarm
