; domain.clp - the planning domain: what holds, what may be executed, what actions change
;
; Needs plan.clp, goal.clp and saliences.clp.
;
; 1. The domain model: templates which a domain (or the PDDL parser) fills in.
; 2. Functions on the model.
; 3. Index: the domain arranged for look-up, kept up to date by logical support.
; 4. Grounding: preconditions of the plan's actions with the actions' arguments put in.
; 5. Checking: what is satisfied, and hence which actions are executable.
; 6. Effects: what a successful action changes.
; 7. Preconditions of exogenous operators.
; 8. Types of objects, and errors in the model.
;
; One change of a fact costs what depends on it, however many goals, plans and facts there are.
; Facts are therefore found by joins on single fields (CLIPS hashes these, but not multifields),
; hence the keys of ground atoms below. docs/core-domain.md tells more.

; ---------------------------------------------------------------- 1. the domain model

(deftemplate domain-object-type
  "A type of objects; all types descend from the type object."
  (slot super-type (default object) (type SYMBOL)) (slot name (type SYMBOL)))

(deftemplate domain-object
  "An object, with the most specific of its types."
  (slot type (default object) (type SYMBOL)) (slot name))

(deftemplate domain-predicate
  "The declaration of a predicate."
  (slot name (default ?NONE) (type SYMBOL))
  ; the arguments
  (multislot param-names (type SYMBOL)) (multislot param-types (type SYMBOL))
  ; sensed: actions do not change it, somebody observes the change and tells
  (slot sensed (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; value predicate: a partial function, the last argument is the value of the others
  (slot value-predicate (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate domain-fact
  "A ground atom that is true. Everything else is false."
  (slot name (default ?NONE) (type SYMBOL)) (multislot param-values))

(deftemplate domain-pending-sensed-fact
  "An effect on a sensed predicate that an action still waits for."
  (slot name (default ?NONE) (type SYMBOL)) (multislot param-values)
  (slot type (default POSITIVE) (type SYMBOL) (allowed-values POSITIVE NEGATIVE))
  ; the action that waits
  (slot action-id (type INTEGER)) (slot plan-id (type SYMBOL)) (slot goal-id (type SYMBOL)))

(deftemplate domain-operator
  "An operator; its parameters' types, precondition and effects are facts of their own."
  (slot name (type SYMBOL)) (multislot param-names)
  ; exogenous: somebody else's doing, which the plan only takes into account
  (slot exogenous (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; whether an action waits until its sensed effects have been observed
  (slot wait-sensed (default TRUE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate domain-operator-parameter
  "The type of one parameter of an operator."
  (slot operator (type SYMBOL)) (slot type (default object) (type SYMBOL)) (slot name))

(deftemplate domain-effect
  "One literal that an operator (part-of) makes true (POSITIVE) or false (NEGATIVE). It is
   conditional if there are pddl-formula facts which are part-of the effect's name."
  (slot part-of (type SYMBOL)) (slot name (default-dynamic (gensym*)) (type SYMBOL))
  (slot predicate (type SYMBOL))
  (slot type (default POSITIVE) (type SYMBOL) (allowed-values POSITIVE NEGATIVE))
  ; a constant that is neither missing nor nil stands for the parameter in the same place
  (multislot param-names (default)) (multislot param-constants (default))
  (multislot param-values (default)))

(deftemplate domain-error
  "Something is wrong with the domain. Told once, and without consequences."
  (slot error-type (type SYMBOL)) (slot error-msg (type STRING)))

(deftemplate pddl-formula
  "An inner node of a condition. The root is part-of an operator or of an effect."
  (slot part-of (type SYMBOL)) (slot id (default ?NONE) (type SYMBOL))
  (slot type (type SYMBOL) (allowed-values conjunction disjunction negation atom)))

(deftemplate pddl-predicate
  "A leaf of a condition, part-of a formula: an atom, or EQUALITY of two terms."
  (slot part-of (type SYMBOL)) (slot id (default ?NONE) (type SYMBOL))
  (slot predicate (type SYMBOL))
  ; constants as in domain-effect
  (multislot param-names (type SYMBOL)) (multislot param-constants))

(deftemplate pddl-grounding
  "The arguments with which conditions have been grounded; plan-action.precondition is its id."
  (slot id (default ?NONE) (type SYMBOL))
  (multislot param-values (type SYMBOL)) (multislot param-names (type SYMBOL)))

(deftemplate grounded-pddl-formula
  "A pddl-formula (formula-id) in one grounding, and whether it is satisfied there."
  (slot id (default ?NONE) (type SYMBOL))
  (slot grounding (type SYMBOL)) (slot formula-id (type SYMBOL))
  (slot is-satisfied (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate grounded-pddl-predicate
  "A pddl-predicate (predicate-id) in one grounding, and whether it is satisfied there."
  (slot id (default ?NONE) (type SYMBOL))
  (slot grounding (type SYMBOL)) (slot predicate-id (type SYMBOL))
  (slot is-satisfied (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

; ---------------------------------------------------------------- 2. functions on the model

(deffunction domain-wipe
  "Forget the domain and everything that has been grounded in it."
  ()
  (progn$ (?template (create$ domain-fact domain-object domain-object-type domain-predicate
                              domain-effect domain-operator domain-operator-parameter
                              pddl-predicate pddl-formula pddl-grounding domain-error))
    (delayed-do-for-all-facts ((?f ?template)) TRUE (retract ?f))))

(deffunction domain-fact-args
  "The arguments in the form of a world model key: args? name value name value ..., or ();
   FALSE if there are not as many names as values."
  (?param-names ?param-values)
  (if (<> (length$ ?param-names) (length$ ?param-values)) then
    (printout error "Domain fact arguments: " (length$ ?param-names) " names ("
                    (implode$ ?param-names) ") but " (length$ ?param-values) " values ("
                    (implode$ ?param-values) ")" crlf)
    (return FALSE))
  (if (= (length$ ?param-names) 0) then (return (create$)))
  (bind ?args (create$ args?))
  (progn$ (?name ?param-names)
    (bind ?args (create$ ?args ?name (nth$ ?name-index ?param-values))))
  (return ?args))

(deffunction domain-fact-key
  "The world model key of a fact: its name and then its arguments (domain-fact-args)."
  (?name ?param-names ?param-values)
  (bind ?args (domain-fact-args ?param-names ?param-values))
  (if (eq ?args FALSE) then (return FALSE))
  (return (create$ ?name ?args)))

(deffunction domain-param-value-for-name
  "The value of one parameter, FALSE if there is none of that name."
  (?param-values ?param-names ?param-name)
  (bind ?position (member$ ?param-name ?param-names))
  (if ?position then (return (nth$ ?position ?param-values)))
  (return FALSE))

(deffunction domain-build-ground-parameter-list
  "The values of a predicate's terms: the constant, else the value of the parameter;
   FALSE (and an error) if a parameter is unknown."
  (?names ?constants ?grounded-names ?grounded-values)
  (bind ?values (create$))
  (progn$ (?name ?names)
    (bind ?value (nth$ ?name-index ?constants))
    (if (eq ?value nil) then
      (bind ?position (member$ ?name ?grounded-names))
      (if (not ?position) then
        (printout error "PDDL Predicate has unknown parameter " ?name
                        " (" ?grounded-names " vs " ?names ") " crlf)
        (return FALSE))
      (bind ?value (nth$ ?position ?grounded-values)))
    (bind ?values (create$ ?values ?value)))
  (return ?values))

(deffunction domain-check-grounding-match
  "Whether a predicate has just these values in a grounding."
  (?param-names ?domain-values ?predicate-constants ?grounded-params ?grounded-values)
  (return (eq ?domain-values
              (domain-build-ground-parameter-list
                ?param-names ?predicate-constants ?grounded-params ?grounded-values))))

(deffunction domain-check-grounded-equality
  "Whether the two terms of an EQUALITY are the same (also in type) in a grounding."
  (?param-names ?predicate-constants ?grounded-params ?grounded-values)
  (bind ?values (domain-build-ground-parameter-list
                  ?param-names ?predicate-constants ?grounded-params ?grounded-values))
  (if (or (eq ?values FALSE) (<> (length$ ?values) 2)) then (return FALSE))
  (return (eq (nth$ 1 ?values) (nth$ 2 ?values))))

(deffunction domain-ground-effect
  "The values of an effect's terms: the constant, else the value of the action's parameter,
   else the name itself."
  (?effect-param-names ?effect-param-constants ?action-param-names ?action-param-values)
  (bind ?values (create$))
  (progn$ (?name ?effect-param-names)
    (bind ?value (nth$ ?name-index ?effect-param-constants))
    (if (eq ?value nil) then
      (bind ?position (member$ ?name ?action-param-names))
      (bind ?value (if ?position then (nth$ ?position ?action-param-values) else ?name)))
    (bind ?values (create$ ?values ?value)))
  (return ?values))

(deffunction domain-get-operator-for-pddl-predicate
  "The operator whose precondition a formula is a part of, FALSE if there is none."
  (?part-of)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?part-of)
    (return (domain-get-operator-for-pddl-predicate ?f:part-of)))
  (return (if (any-factp ((?o domain-operator)) (eq ?o:name ?part-of))
    then ?part-of else FALSE)))

(deffunction domain-is-formula-negative
  "Whether a formula stands under an odd number of negations, itself included."
  (?precond-id)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?precond-id)
    (return (neq (eq ?f:type negation) (domain-is-formula-negative ?f:part-of))))
  (return FALSE))

(deffunction domain-is-precond-negative
  "The former name of domain-is-formula-negative."
  (?precond-name)
  (return (domain-is-formula-negative ?precond-name)))

(deffunction intersect
  "The elements of the first list that are in the second one too, in the first one's order."
  (?s1 ?s2)
  (bind ?both (create$))
  (progn$ (?element ?s1)
    (if (member$ ?element ?s2) then (bind ?both (create$ ?both ?element))))
  (return ?both))

; ---------------------------------------------------------------- 3. index

(deftemplate domain-true-atom
  "The key of a domain-fact, for look-up by a join on one field."
  (slot key) (multislot values) (slot fact))

(deftemplate domain-value
  "The value of a value predicate for its other arguments (key)."
  (slot key) (multislot arguments) (slot predicate) (slot value))

(deftemplate pddl-formula-node
  "A formula or predicate that belongs to the condition of root, an operator or an effect."
  (slot id) (slot root))

(deftemplate pddl-formula-tree
  "The condition of one root, as lists with one field a node, parents before children."
  (slot root) (slot revision (default-dynamic (gensym*)))
  ; of each node: its pddl-formula or pddl-predicate, its type (or predicate, or equality)
  (multislot ids) (multislot sources) (multislot kinds)
  ; the place of the parent (0: is a root), and the number of children
  (multislot parents) (multislot sizes)
  ; what holds while no atom is satisfied, and then how many children are satisfied
  (multislot truths) (multislot counts))

(deftemplate domain-effect-spec
  "An effect on a declared predicate. The order is that of the domain-effect facts."
  (slot operator) (slot name) (slot order) (slot effect) (slot sensed))

(deftemplate domain-operator-effects
  "The effects of one operator (fact addresses, in order), sensed ones apart."
  (slot operator) (multislot orders) (multislot sensed) (multislot direct)
  ; the names of those that are conditional
  (multislot conditional))

(deffunction domain-atom-key
  "A symbol for a ground atom. Different atoms may share one (numbers that print alike)."
  (?predicate ?values)
  (return (sym-cat ?predicate " " (implode$ ?values))))

(defrule domain-index-fact
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical ?f <- (domain-fact (name ?name) (param-values $?values)))
  =>
  (assert (domain-true-atom (key (domain-atom-key ?name ?values)) (values ?values) (fact ?f))))

(defrule domain-index-value
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical (domain-predicate (name ?name) (value-predicate TRUE))
           (domain-fact (name ?name) (param-values $?args ?value)))
  =>
  (assert (domain-value (key (domain-atom-key ?name ?args)) (arguments ?args)
                        (predicate ?name) (value ?value))))

(defrule domain-index-precondition-root
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula (id ?id) (part-of ?root) (type ?))
           (domain-operator (name ?root)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(defrule domain-index-effect-condition-root
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula (id ?id) (part-of ?root) (type ?))
           (domain-effect (name ?root)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(defrule domain-index-formula
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula-node (id ?parent) (root ?root))
           (pddl-formula (id ?id) (part-of ?parent) (type ?)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(defrule domain-index-predicate
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula-node (id ?parent) (root ?root))
           (pddl-predicate (id ?id) (part-of ?parent) (predicate ?)
                           (param-names $?) (param-constants $?)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(deffunction pddl-node-truth
  "Whether a formula holds when so many of its children do."
  (?kind ?satisfied ?size)
  (switch ?kind
    (case conjunction then (= ?satisfied ?size))
    (case negation then (and (> ?size 0) (= ?satisfied 0)))
    (default (> ?satisfied 0))))

(deffunction pddl-formula-tree-build
  "Collect the nodes below root, level by level, into a new pddl-formula-tree; FALSE if there
   are none."
  (?root)
  (bind ?ids (create$)) (bind ?sources (create$)) (bind ?kinds (create$))
  (bind ?parents (create$)) (bind ?sizes (create$))
  (bind ?place 0) (bind ?id ?root)
  (while (<= ?place (length$ ?ids)) do
    (bind ?known (length$ ?ids))
    (if (not (member$ (nth$ ?place ?kinds) (create$ predicate equality))) then
      (do-for-all-facts ((?f pddl-formula))
          (and (eq ?f:part-of ?id) (not (member$ ?f:id ?ids)))
        (bind ?ids (create$ ?ids ?f:id)) (bind ?sources (create$ ?sources ?f))
        (bind ?kinds (create$ ?kinds ?f:type)) (bind ?parents (create$ ?parents ?place)))
      (if (> ?place 0) then
        (do-for-all-facts ((?p pddl-predicate))
            (and (eq ?p:part-of ?id) (not (member$ ?p:id ?ids)))
          (bind ?ids (create$ ?ids ?p:id)) (bind ?sources (create$ ?sources ?p))
          (bind ?kinds (create$ ?kinds (if (eq ?p:predicate EQUALITY)
                                        then equality else predicate)))
          (bind ?parents (create$ ?parents ?place)))))
    (if (> ?place 0) then (bind ?sizes (create$ ?sizes (- (length$ ?ids) ?known))))
    (bind ?place (+ ?place 1))
    (bind ?id (nth$ ?place ?ids)))
  (if (= (length$ ?ids) 0) then (return FALSE))
  ; bottom up: what holds while no atom is satisfied
  (bind ?truths (create$)) (bind ?counts ?sizes)
  (progn$ (?size ?sizes) (bind ?counts (replace$ ?counts ?size-index ?size-index 0)))
  (loop-for-count (?step 1 (length$ ?ids))
    (bind ?place (- (length$ ?ids) ?step -1))
    (bind ?parent (nth$ ?place ?parents))
    (bind ?holds (pddl-node-truth (nth$ ?place ?kinds) (nth$ ?place ?counts)
                                  (nth$ ?place ?sizes)))
    (bind ?truths (create$ ?holds ?truths))
    (if (and ?holds (> ?parent 0)) then
      (bind ?counts (replace$ ?counts ?parent ?parent (+ (nth$ ?parent ?counts) 1)))))
  (return (assert (pddl-formula-tree
    (root ?root) (ids ?ids) (sources ?sources) (kinds ?kinds) (parents ?parents)
    (sizes ?sizes) (truths ?truths) (counts ?counts)))))

(defrule domain-index-tree
  "Built anew from the nodes after each change."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (pddl-formula-node (root ?root))
  (not (pddl-formula-tree (root ?root)))
  =>
  (pddl-formula-tree-build ?root))

(defrule domain-index-tree-lacks-node
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 20)))
  (pddl-formula-node (id ?id) (root ?root))
  ?tree <- (pddl-formula-tree (root ?root) (ids $?ids&~:(member$ ?id ?ids)))
  =>
  (retract ?tree))

(defrule domain-index-tree-has-former-node
  "Before a changed node is indexed again: its tree is to go in any case."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 40)))
  ?tree <- (pddl-formula-tree (root ?root) (ids $? ?id $?))
  (not (pddl-formula-node (id ?id) (root ?root)))
  =>
  (retract ?tree))

(defrule domain-index-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical ?e <- (domain-effect (name ?name) (part-of ?operator) (predicate ?predicate))
           (domain-predicate (name ?predicate) (sensed ?sensed)))
  =>
  (assert (domain-effect-spec (operator ?operator) (name ?name) (sensed ?sensed) (effect ?e)
                              (order (fact-index ?e)))))

(deffunction domain-fact-is-later (?a ?b) (> (fact-index ?a) (fact-index ?b)))

(defrule domain-index-operator-effects
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (domain-operator (name ?operator))
  (not (domain-operator-effects (operator ?operator)))
  =>
  (bind ?orders (create$)) (bind ?sensed (create$)) (bind ?direct (create$))
  (do-for-all-facts ((?s domain-effect-spec)) (eq ?s:operator ?operator)
    (bind ?orders (create$ ?orders ?s:order))
    (if (eq ?s:sensed TRUE)
     then (bind ?sensed (create$ ?sensed ?s:effect))
     else (bind ?direct (create$ ?direct ?s:effect))))
  (assert (domain-operator-effects (operator ?operator) (orders ?orders)
    (sensed (sort domain-fact-is-later ?sensed))
    (direct (sort domain-fact-is-later ?direct)))))

(defrule domain-index-operator-lacks-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 20)))
  (domain-effect-spec (operator ?operator) (order ?order))
  ?effects <- (domain-operator-effects (operator ?operator)
                                       (orders $?orders&~:(member$ ?order ?orders)))
  =>
  (retract ?effects))

(defrule domain-index-operator-has-former-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 40)))
  ?effects <- (domain-operator-effects (operator ?operator) (orders $? ?order $?))
  (not (domain-effect-spec (operator ?operator) (order ?order)))
  =>
  (retract ?effects))

(defrule domain-index-effect-is-conditional
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (pddl-formula-tree (root ?name))
  (domain-effect-spec (name ?name) (operator ?operator))
  ?effects <- (domain-operator-effects (operator ?operator)
                                       (conditional $?names&~:(member$ ?name ?names)))
  =>
  (modify ?effects (conditional ?names ?name)))

(defrule domain-index-effect-is-unconditional
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  ?effects <- (domain-operator-effects (conditional $?before ?name $?after))
  (not (pddl-formula-node (root ?name)))
  =>
  (modify ?effects (conditional ?before ?after)))

; ---------------------------------------------------------------- 4. grounding

(deftemplate grounded-pddl-tree
  "A pddl-formula-tree in one grounding: one fact address a node, in the tree's order."
  (slot grounding) (slot root) (slot tree) (slot revision)
  (multislot facts) (multislot leaves)
  ; how many children of each node are satisfied; which root formulas are
  (multislot counts) (multislot satisfied)
  ; the pddl-grounding, and whether it goes when no plan-action refers to it any more
  (slot grounding-fact) (slot of-action))

(deftemplate grounded-pddl-leaf
  "The ground atom that decides one leaf (place) of a grounded tree."
  (slot key) (multislot values) (slot tree) (slot place) (slot satisfied (default FALSE)))

(deftemplate domain-met-conditions
  "Which conditional effects of an action apply. Settled when it has succeeded."
  (slot grounding) (multislot effects))

(deffunction grounded-pddl-tree-set
  "Set one leaf of a grounded tree and carry the change up as far as it matters."
  (?grounded ?place ?value)
  (bind ?tree (fact-slot-value ?grounded tree))
  (bind ?facts (fact-slot-value ?grounded facts))
  (bind ?kinds (fact-slot-value ?tree kinds))
  (bind ?parents (fact-slot-value ?tree parents))
  (bind ?counts (fact-slot-value ?grounded counts))
  (while TRUE do
    (modify (nth$ ?place ?facts) (is-satisfied ?value))
    (bind ?parent (nth$ ?place ?parents))
    (if (= ?parent 0) then
      (bind ?roots (fact-slot-value ?grounded satisfied))
      (bind ?id (nth$ ?place (fact-slot-value ?tree ids)))
      (bind ?roots (if ?value then (create$ ?roots ?id) else (delete-member$ ?roots ?id)))
      (modify ?grounded (counts ?counts) (satisfied ?roots))
      (return))
    (bind ?kind (nth$ ?parent ?kinds)) (bind ?count (nth$ ?parent ?counts))
    (bind ?size (nth$ ?parent (fact-slot-value ?tree sizes)))
    (bind ?before (pddl-node-truth ?kind ?count ?size))
    (bind ?count (if ?value then (+ ?count 1) else (- ?count 1)))
    (bind ?counts (replace$ ?counts ?parent ?parent ?count))
    (bind ?value (pddl-node-truth ?kind ?count ?size))
    (if (eq ?value ?before) then
      (modify ?grounded (counts ?counts))
      (return))
    (bind ?place ?parent)))

(deffunction domain-check-equality-arity (?predicate-id ?names ?values)
  (if (<> (length$ ?values) 2) then
    (assert (domain-error (error-type equality-must-have-exactly-two-parameters)
      (error-msg (str-cat "Predicate " ?predicate-id " is an equality precondition but has "
                          (length$ ?names) " parameters, should be 2."))))))

(deffunction pddl-formula-tree-ground
  "Ground each node of a tree. The atoms count as not satisfied until they have been looked up."
  (?tree ?names ?values ?grounding-fact ?of-action)
  (bind ?grounding (fact-slot-value ?grounding-fact id))
  (bind ?ids (fact-slot-value ?tree ids)) (bind ?sources (fact-slot-value ?tree sources))
  (bind ?truths (fact-slot-value ?tree truths)) (bind ?parents (fact-slot-value ?tree parents))
  (bind ?facts (create$)) (bind ?leaves (create$)) (bind ?roots (create$)) (bind ?equal (create$))
  (bind ?grounded (assert (grounded-pddl-tree
    (grounding ?grounding) (root (fact-slot-value ?tree root)) (tree ?tree)
    (revision (fact-slot-value ?tree revision))
    (grounding-fact ?grounding-fact) (of-action ?of-action))))
  (progn$ (?kind (fact-slot-value ?tree kinds))
    (bind ?id (nth$ ?kind-index ?ids)) (bind ?source (nth$ ?kind-index ?sources))
    (if (or (eq ?kind predicate) (eq ?kind equality))
     then
      (bind ?grounded-id (sym-cat grounded- ?id - ?grounding))
      (bind ?fact (assert (grounded-pddl-predicate
        (id ?grounded-id) (predicate-id ?id) (grounding ?grounding))))
      (bind ?terms (domain-build-ground-parameter-list
        (fact-slot-value ?source param-names) (fact-slot-value ?source param-constants)
        ?names ?values))
      (if (neq ?terms FALSE) then
        (if (eq ?kind predicate)
         then
          (bind ?leaves (create$ ?leaves (assert (grounded-pddl-leaf
            (key (domain-atom-key (fact-slot-value ?source predicate) ?terms)) (values ?terms)
            (tree ?grounded) (place ?kind-index)))))
         else
          (domain-check-equality-arity ?grounded-id (fact-slot-value ?source param-names) ?terms)
          (if (and (= (length$ ?terms) 2) (eq (nth$ 1 ?terms) (nth$ 2 ?terms))) then
            (bind ?equal (create$ ?equal ?kind-index)))))
     else
      (bind ?fact (assert (grounded-pddl-formula
        (id (sym-cat grounded- ?id - (gensym*))) (formula-id ?id) (grounding ?grounding)
        (is-satisfied (nth$ ?kind-index ?truths)))))
      (if (and (= (nth$ ?kind-index ?parents) 0) (nth$ ?kind-index ?truths)) then
        (bind ?roots (create$ ?roots ?id))))
    (bind ?facts (create$ ?facts ?fact)))
  (modify ?grounded (facts ?facts) (leaves ?leaves) (satisfied ?roots)
                    (counts (fact-slot-value ?tree counts)))
  (progn$ (?place ?equal) (grounded-pddl-tree-set ?grounded ?place TRUE)))

(deffunction pddl-grounding-for-tree
  "A new pddl-grounding, named after the first root formula of a tree."
  (?tree ?names ?values)
  (return (assert (pddl-grounding
    (id (sym-cat grounding- (nth$ 1 (fact-slot-value ?tree ids)) - (gensym*)))
    (param-names ?names) (param-values ?values)))))

(deffunction grounded-pddl-tree-drop
  "Retract a grounded tree. It and its leaves refer to each other: CLIPS would never free them."
  (?grounded)
  (bind ?facts (create$ (fact-slot-value ?grounded leaves) (fact-slot-value ?grounded facts)))
  (modify ?grounded (leaves) (facts))
  (retract ?grounded)
  (progn$ (?fact ?facts) (if (fact-existp ?fact) then (retract ?fact))))

(deffunction ground-pddl-formula
  "Ground the formulas which are part-of parent-id, in a new grounding if grounding-id is nil.
   Returns the id of the grounding, nil if there is nothing to ground."
  (?parent-id ?param-names ?param-values ?grounding-id)
  (bind ?tree FALSE)
  (do-for-fact ((?t pddl-formula-tree)) (eq ?t:root ?parent-id) (bind ?tree ?t))
  (if (not ?tree) then (bind ?tree (pddl-formula-tree-build ?parent-id)))
  (if (not ?tree) then (return ?grounding-id))
  (bind ?grounding FALSE)
  (do-for-fact ((?g pddl-grounding)) (eq ?g:id ?grounding-id) (bind ?grounding ?g))
  (if (not ?grounding) then
    (bind ?grounding (pddl-grounding-for-tree ?tree ?param-names ?param-values)))
  (pddl-formula-tree-ground ?tree ?param-names ?param-values ?grounding FALSE)
  (return (fact-slot-value ?grounding id)))

(deffunction ground-pddl-predicate
  "Make the grounded-pddl-predicate facts for the predicates which are part-of parent-id."
  (?parent-id ?param-names ?param-values ?grounding-id)
  (do-for-all-facts ((?p pddl-predicate)) (eq ?p:part-of ?parent-id)
    (assert (grounded-pddl-predicate (id (sym-cat grounded- ?p:id - ?grounding-id))
                                     (predicate-id ?p:id) (grounding ?grounding-id)))))

(deffunction domain-retract-grounding
  "Retract a grounding with all that belongs to it; actions that refer to it get a new one."
  (?action-precond)
  (delayed-do-for-all-facts ((?t grounded-pddl-tree)) (eq ?t:grounding ?action-precond)
    (grounded-pddl-tree-drop ?t))
  (delayed-do-for-all-facts ((?g pddl-grounding)) (eq ?g:id ?action-precond)
    (retract ?g))
  (do-for-all-facts ((?a plan-action))
      (and (neq ?action-precond nil) (eq ?a:precondition ?action-precond))
    (modify ?a (precondition nil))))

(defrule domain-amend-action-params
  "An action with values only gets the names from its operator."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 5)))
  ?action <- (plan-action (action-name ?operator) (param-names) (param-values ? $?))
  (domain-operator (name ?operator) (param-names $?names&:(> (length$ ?names) 0)))
  =>
  (modify ?action (param-names ?names)))

(defrule domain-ground-plan-action-precondition
  "Ground the precondition of an action that has still to be executed."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  ?action <- (plan-action (precondition nil) (state ~FINAL&~FAILED) (action-name ?operator)
                          (param-names $?names) (param-values $?values))
  (domain-operator (name ?operator)
                   (param-names $?parameters&:(= (length$ ?parameters) (length$ ?names))))
  ?tree <- (pddl-formula-tree (root ?operator))
  =>
  (bind ?grounding (pddl-grounding-for-tree ?tree ?names ?values))
  (pddl-formula-tree-ground ?tree ?names ?values ?grounding TRUE)
  (modify ?action (precondition (fact-slot-value ?grounding id))))

(defrule domain-ground-effect-precondition
  "Ground the conditions of effects of an action that has succeeded."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (precondition ?id) (param-names $?names) (param-values $?values))
  (domain-operator-effects (operator ?operator) (conditional $? ?effect $?))
  ?tree <- (pddl-formula-tree (root ?effect))
  (not (grounded-pddl-tree (grounding ?id) (root ?effect)))
  =>
  (bind ?grounding FALSE)
  (if (neq ?id nil) then
    (do-for-fact ((?g pddl-grounding)) (eq ?g:id ?id) (bind ?grounding ?g)))
  (if (not ?grounding) then
    (bind ?grounding (pddl-grounding-for-tree ?tree ?names ?values))
    (modify ?action (precondition (fact-slot-value ?grounding id))))
  (pddl-formula-tree-ground ?tree ?names ?values ?grounding TRUE))

(defrule domain-ground-effect-precondition-begin
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator) (precondition ?id&~nil))
  (domain-operator-effects (operator ?operator) (conditional ? $?))
  (not (domain-met-conditions (grounding ?id)))
  =>
  (assert (domain-met-conditions (grounding ?id))))

; Cleaning up. Retracting the pddl-grounding is enough: the rest follows it.

(defrule domain-grounding-of-finished-action
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?action <- (plan-action (state FINAL|FAILED) (precondition ~nil))
  =>
  (modify ?action (precondition nil)))

(defrule domain-grounding-without-action
  "The action is finished, is gone, or has got another grounding."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  (grounded-pddl-tree (grounding ?id) (of-action TRUE) (grounding-fact ?grounding))
  (not (plan-action (precondition ?id)))
  =>
  (if (fact-existp ?grounding) then (retract ?grounding)))

(defrule domain-retract-grounding-for-plan-action-if-precondition-mismatch
  "The arguments of an action have been changed."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?grounding <- (pddl-grounding (id ?id) (param-values $?values))
  (plan-action (precondition ?id) (param-values ~$?values))
  =>
  (retract ?grounding))

(defrule domain-grounding-is-outdated
  "The condition itself has been changed."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  (grounded-pddl-tree (revision ?revision) (grounding ?id))
  (not (pddl-formula-tree (revision ?revision)))
  ?grounding <- (pddl-grounding (id ?id))
  =>
  (retract ?grounding))

(defrule domain-grounding-cleanup
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?grounded <- (grounded-pddl-tree (grounding ?id))
  (not (pddl-grounding (id ?id)))
  =>
  (grounded-pddl-tree-drop ?grounded))

(defrule domain-grounding-cleanup-conditions
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?met <- (domain-met-conditions (grounding ?id))
  (not (pddl-grounding (id ?id)))
  =>
  (retract ?met))

(defrule domain-grounding-cleanup-action
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?action <- (plan-action (precondition ?id&~nil))
  (not (pddl-grounding (id ?id)))
  =>
  (modify ?action (precondition nil)))

; ---------------------------------------------------------------- 5. checking

(defrule domain-check-grounded-predicate
  "A ground atom is satisfied if there is such a domain-fact."
  (declare (salience ?*SALIENCE-DOMAIN-CHECK*))
  ?leaf <- (grounded-pddl-leaf (satisfied FALSE) (key ?key) (values $?values)
                               (tree ?grounded) (place ?place))
  (domain-true-atom (key ?key) (values $?values))
  =>
  (modify ?leaf (satisfied TRUE))
  (grounded-pddl-tree-set ?grounded ?place TRUE))

(defrule domain-check-if-predicate-is-unsatisfied
  (declare (salience ?*SALIENCE-DOMAIN-CHECK*))
  ?leaf <- (grounded-pddl-leaf (satisfied TRUE) (key ?key) (values $?values)
                               (tree ?grounded) (place ?place))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (modify ?leaf (satisfied FALSE))
  (grounded-pddl-tree-set ?grounded ?place FALSE))

; What follows from the atoms waits until they have all been looked up.

(defrule domain-check-if-action-precondition-is-satisfied
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable FALSE) (precondition ?id&~nil) (action-name ?operator))
  (grounded-pddl-tree (grounding ?id) (root ?operator) (satisfied ?formula $?))
  =>
  (modify ?action (executable TRUE))
  (if (eq (fact-slot-value ?action state) PENDING) then
    (printout t "Action " (fact-slot-value ?action id) " is executable based on " ?formula crlf)))

(defrule domain-check-if-action-precondition-is-unsatisfied
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable TRUE) (precondition ?id&~nil) (action-name ?operator))
  (grounded-pddl-tree (grounding ?id) (root ?operator) (satisfied))
  =>
  (modify ?action (executable FALSE))
  (if (eq (fact-slot-value ?action state) PENDING) then
    (printout t "Action " (fact-slot-value ?action id) " is no longer executable" crlf)))

(defrule domain-check-if-action-is-executable-without-precondition
  "Nothing could be grounded: no formula, no operator, or not the operator's parameters."
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable FALSE) (precondition nil) (state ~FINAL&~FAILED))
  =>
  (modify ?action (executable TRUE)))

(defrule domain-check-effect-condition
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  (plan-action (state EXECUTION-SUCCEEDED) (precondition ?id&~nil) (action-name ?operator))
  (domain-operator-effects (operator ?operator) (conditional $? ?effect $?))
  (grounded-pddl-tree (grounding ?id) (root ?effect) (satisfied ? $?))
  ?met <- (domain-met-conditions (grounding ?id) (effects $?effects&~:(member$ ?effect ?effects)))
  =>
  (modify ?met (effects ?effects ?effect)))

; ---------------------------------------------------------------- 6. effects

(deftemplate domain-fact-removal
  "A negative effect on its way: the domain-fact goes before anything else happens."
  (slot key) (multislot values))

(deftemplate domain-awaited-atom
  "The key of a domain-pending-sensed-fact."
  (slot key) (multislot values) (slot type) (slot pending))

(deffunction domain-effects-met
  "Those of the effects that are not conditional, or whose condition is met."
  (?effects ?conditional ?met)
  (if (= (length$ ?conditional) 0) then (return ?effects))
  (bind ?applicable (create$))
  (progn$ (?effect ?effects)
    (bind ?name (fact-slot-value ?effect name))
    (if (or (not (member$ ?name ?conditional)) (member$ ?name ?met)) then
      (bind ?applicable (create$ ?applicable ?effect))))
  (return ?applicable))

(deffunction domain-effect-values (?effect ?action)
  (return (domain-ground-effect
    (fact-slot-value ?effect param-names) (fact-slot-value ?effect param-constants)
    (fact-slot-value ?action param-names) (fact-slot-value ?action param-values))))

(deffunction domain-action-await-effects
  "Expect these sensed effects."
  (?action ?effects)
  (progn$ (?effect ?effects)
    (assert (domain-pending-sensed-fact
      (name (fact-slot-value ?effect predicate)) (type (fact-slot-value ?effect type))
      (param-values (domain-effect-values ?effect ?action))
      (action-id (fact-slot-value ?action id)) (plan-id (fact-slot-value ?action plan-id))
      (goal-id (fact-slot-value ?action goal-id)))))
  (modify ?action
    (state (if (> (length$ ?effects) 0) then SENSED-EFFECTS-WAIT else SENSED-EFFECTS-HOLD))))

(deffunction domain-action-apply-effects
  "Apply these effects. What one makes true another one does not make false."
  (?action ?effects)
  (bind ?made (create$))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) POSITIVE) then
      (bind ?name (fact-slot-value ?effect predicate))
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?made (create$ ?made (domain-atom-key ?name ?values)))
      (assert (domain-fact (name ?name) (param-values ?values)))))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) NEGATIVE) then
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?key (domain-atom-key (fact-slot-value ?effect predicate) ?values))
      (if (not (member$ ?key ?made)) then
        (assert (domain-fact-removal (key ?key) (values ?values))))))
  (modify ?action (state EFFECTS-APPLIED)))

(defrule domain-effects-remove-fact
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (domain-true-atom (key ?key) (values $?values) (fact ?fact))
  =>
  (retract ?removal ?fact))

(defrule domain-effects-remove-no-fact
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (retract ?removal))

(defrule domain-effects-check-for-sensed
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (sensed $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-await-effects ?action ?effects))

(defrule domain-effects-check-for-sensed-conditional
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan) (precondition ?id))
  (domain-operator-effects (operator ?operator) (sensed $?effects)
                           (conditional $?conditional&:(> (length$ ?conditional) 0)))
  (domain-met-conditions (grounding ?id) (effects $?met))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-await-effects ?action (domain-effects-met ?effects ?conditional ?met)))

(defrule domain-effects-apply
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-HOLD) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (direct $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-apply-effects ?action ?effects))

(defrule domain-effects-apply-conditional
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-HOLD) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan) (precondition ?id))
  (domain-operator-effects (operator ?operator) (direct $?effects)
                           (conditional $?conditional&:(> (length$ ?conditional) 0)))
  (domain-met-conditions (grounding ?id) (effects $?met))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-apply-effects ?action (domain-effects-met ?effects ?conditional ?met)))

(defrule domain-index-awaited-atom
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical ?p <- (domain-pending-sensed-fact (name ?name) (param-values $?values) (type ?type)))
  =>
  (assert (domain-awaited-atom (key (domain-atom-key ?name ?values)) (values ?values)
                               (type ?type) (pending ?p))))

(defrule domain-effect-sensed-positive-holds
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  (domain-awaited-atom (type POSITIVE) (key ?key) (values $?values) (pending ?effect))
  (domain-true-atom (key ?key) (values $?values))
  =>
  (retract ?effect))

(defrule domain-effect-sensed-negative-holds
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  (domain-awaited-atom (type NEGATIVE) (key ?key) (values $?values) (pending ?effect))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (retract ?effect))

(defrule domain-effects-ignore-sensed
  "The operator does not wait for its sensed effects; they stay pending."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-WAIT) (action-name ?operator))
  (domain-operator (name ?operator) (wait-sensed FALSE))
  =>
  (modify ?action (state SENSED-EFFECTS-HOLD)))

(defrule domain-effect-wait-sensed-done
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-WAIT)
                          (id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (domain-pending-sensed-fact (action-id ?a&:(eq ?a ?id)) (plan-id ?p&:(eq ?p ?plan))
                                   (goal-id ?goal)))
  =>
  (modify ?action (state SENSED-EFFECTS-HOLD)))

(defrule domain-effect-sensed-remove-on-removed-action
  ?effect <- (domain-pending-sensed-fact (action-id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (plan-action (id ?a&:(eq ?a ?id)) (plan-id ?p&:(eq ?p ?plan)) (goal-id ?goal)))
  =>
  (retract ?effect))

(defrule domain-action-final
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EFFECTS-APPLIED))
  =>
  (modify ?action (state FINAL) (precondition nil)))

(defrule domain-action-failed
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-FAILED))
  =>
  (modify ?action (state FAILED) (precondition nil)))

; ---------------------------------------------------------------- 7. exogenous operators

(deffunction remove-precondition
  "Remove a pddl-predicate or pddl-formula (a fact) from its condition, together with each
   negation, atom and disjunction that has nothing left; if that is the whole condition, put
   one in its place that is always satisfied."
  (?precond-fact)
  (bind ?id (fact-slot-value ?precond-fact id))
  (bind ?part-of (fact-slot-value ?precond-fact part-of))
  (bind ?parent FALSE)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?part-of) (bind ?parent ?f))
  (retract ?precond-fact)
  (if (not ?parent) then
    (assert (pddl-formula (id ?id) (part-of ?part-of) (type conjunction)))
    (return))
  (if (and (neq (fact-slot-value ?parent type) conjunction)
           (not (any-factp ((?f pddl-formula)) (eq ?f:part-of ?part-of)))
           (not (any-factp ((?p pddl-predicate)) (eq ?p:part-of ?part-of)))) then
    (remove-precondition ?parent)))

(defrule domain-remove-precond-on-sensed-nonval-effect-of-exog-action
  "What an exogenous action changes may have changed before the action is selected: its
   precondition does not ask for it."
  (domain-operator (name ?operator) (exogenous TRUE))
  (domain-effect (part-of ?operator) (predicate ?predicate)
                 (param-names $?names) (param-constants $?constants))
  (domain-predicate (name ?predicate) (sensed TRUE) (value-predicate FALSE))
  ?atom <- (pddl-predicate (predicate ?predicate) (id ?id)
                           (param-names $?names) (param-constants $?constants))
  (pddl-formula-node (id ?id) (root ?operator))
  =>
  (remove-precondition ?atom))

(deffunction domain-is-other-value
  "Whether two last terms of a predicate differ, each a constant or a parameter."
  (?name ?constants ?other-name ?other-constants ?arguments)
  (bind ?constant (nth$ (+ ?arguments 1) ?constants))
  (bind ?other (nth$ (+ ?arguments 1) ?other-constants))
  (if (and (eq ?constant nil) (eq ?other nil)) then (return (neq ?name ?other-name)))
  (return (neq ?constant ?other)))

(defrule domain-replace-precond-on-sensed-val-effect-of-exog-action
  "Likewise for a value: the precondition also accepts the one that the action leads to."
  (domain-operator (name ?operator) (exogenous TRUE))
  (domain-effect (part-of ?operator) (predicate ?predicate) (type POSITIVE)
                 (param-names $?names ?name) (param-constants $?constants))
  (domain-predicate (name ?predicate) (sensed TRUE) (value-predicate TRUE))
  ?atom <- (pddl-predicate (predicate ?predicate) (id ?id) (part-of ?parent)
                           (param-names $?names ?old) (param-constants $?old-constants))
  (pddl-formula-node (id ?id) (root ?operator))
  (test (domain-is-other-value ?name ?constants ?old ?old-constants (length$ ?names)))
  (not (pddl-predicate (part-of ?parent) (predicate ?predicate)
                       (param-names $?names ?name) (param-constants $?constants)))
  =>
  (assert (pddl-formula (id ?id) (part-of ?parent) (type disjunction)))
  (modify ?atom (id (sym-cat ?id 1)) (part-of ?id))
  (assert (pddl-predicate (id (sym-cat ?id 2)) (part-of ?id) (predicate ?predicate)
                          (param-names ?names ?name) (param-constants ?constants))))

; ---------------------------------------------------------------- 8. types and errors

(defrule domain-add-type-object
  (not (domain-object-type (name object)))
  =>
  (assert (domain-object-type (name object))))

(defrule domain-translate-obj-slot-type-to-ordered-fact
  "The types of an object, its super-types included, are also ordered facts."
  (domain-object (type ?type) (name ?object))
  =>
  (assert (domain-obj-is-of-type ?object ?type)))

(defrule domain-get-transitive-types
  (domain-obj-is-of-type ?object ?type&~object)
  (domain-object-type (name ?type) (super-type ?super))
  =>
  (assert (domain-obj-is-of-type ?object ?super)))

(deffunction domain-report (?type $?message)
  (assert (domain-error (error-type ?type) (error-msg (str-cat (expand$ ?message))))))

(defrule domain-print-error
  (domain-error (error-msg ?message) (error-type ?type))
  =>
  (printout error "Domain error '" ?type "': " ?message crlf))

(defrule domain-check-object-types-exist
  (domain-object (type ?type) (name ?object))
  (not (domain-object-type (name ?type)))
  =>
  (domain-report type-of-object-does-not-exist
    "Type " ?type " of object " ?object " does not exist."))

(defrule domain-check-super-type-exists
  (domain-object-type (super-type ?super&~object) (name ?type))
  (not (domain-object-type (name ?super)))
  =>
  (domain-report super-type-does-not-exist
    "Super-type " ?super " of type " ?type " does not exist."))

(defrule domain-check-operator-of-action-exists
  (plan-action (action-name ?operator))
  (not (domain-operator (name ?operator)))
  =>
  (domain-report operator-of-action-does-not-exist
    "Operator of action " ?operator " does not exist"))

(defrule domain-check-pddl-predicate-has-domain-prediacte
  (pddl-predicate (predicate nil) (id ?id))
  =>
  (domain-report precondition-must-have-predicate-or-be-equality
    "pddl-predicate " ?id " must have a predicate"))

(defrule domain-check-value-predicate-must-have-only-one-value
  "The error goes with its cause."
  (logical (domain-value (key ?key) (predicate ?predicate) (arguments $?args) (value ?value))
           (domain-value (key ?key) (predicate ?predicate) (arguments $?args)
                         (value ?other&~?value)))
  =>
  (domain-report value-predicate-with-multiple-values
    "Value predicate " ?predicate "(" (implode$ ?args) ") has multiple values ("
    ?value ", " ?other ")"))

(defrule domain-check-effects-on-value-predicates-must-occur-in-pairs
  (domain-effect (part-of ?operator) (predicate ?predicate) (name ?name)
                 (type ?type) (param-names $?args ?))
  (domain-predicate (value-predicate TRUE) (name ?predicate))
  (not (domain-effect (part-of ?operator) (predicate ?predicate)
                      (type ~?type) (param-names $?args ?)))
  =>
  (domain-report value-predicate-without-paired-effect
    "Effect " ?name " of operator " ?operator " on " ?predicate " (" (implode$ ?args)
    ") is not matched with a complementary effect"))
